within ;
package Modelica "What an exported package needs of the Modelica Standard Library 4.0.0, for tests without the library"
  package Units
    package SI
      type Position = Real(final quantity="Length", final unit="m");
      type Velocity = Real(final quantity="Velocity", final unit="m/s");
      type Force = Real(final quantity="Force", final unit="N");
    end SI;
  end Units;

  package Blocks
    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
    end Interfaces;
  end Blocks;

  package Mechanics
    package Translational
      package Interfaces
        connector Flange_a
          Modelica.Units.SI.Position s;
          flow Modelica.Units.SI.Force f;
        end Flange_a;

        connector Flange_b
          Modelica.Units.SI.Position s;
          flow Modelica.Units.SI.Force f;
        end Flange_b;

        partial model PartialCompliant
          Flange_a flange_a;
          Flange_b flange_b;
          Modelica.Units.SI.Position s_rel(start=0);
          Modelica.Units.SI.Force f;
        equation
          s_rel = flange_b.s - flange_a.s;
          flange_b.f = f;
          flange_a.f = -f;
        end PartialCompliant;
      end Interfaces;
    end Translational;
  end Mechanics;
end Modelica;
