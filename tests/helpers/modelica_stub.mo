within ;
package Modelica "What the exported library needs of the Modelica Standard Library 4.0.0, for tests without that library"
  package Icons
    partial package Package end Package;
    partial package ExamplesPackage extends Package; end ExamplesPackage;
    partial package FunctionsPackage extends Package; end FunctionsPackage;
    partial package RecordsPackage extends Package; end RecordsPackage;
    partial class Information end Information;
    partial class References end References;
    partial model Example end Example;
    partial function Function end Function;
    partial record Record end Record;
  end Icons;

  package Constants
    final constant Real pi=3.141592653589793;
  end Constants;

  package Units
    package SI
      type Time = Real(final quantity="Time", final unit="s");
      type Frequency = Real(final quantity="Frequency", final unit="Hz");
      type Mass = Real(final quantity="Mass", final unit="kg", min=0);
      type Length = Real(final quantity="Length", final unit="m");
      type Position = Length;
      type Velocity = Real(final quantity="Velocity", final unit="m/s");
      type Acceleration = Real(final quantity="Acceleration", final unit="m/s2");
      type Force = Real(final quantity="Force", final unit="N");
      type Energy = Real(final quantity="Energy", final unit="J");
      type TranslationalSpringConstant = Real(final quantity="TranslationalSpringConstant", final unit="N/m");
    end SI;
  end Units;

  package Blocks
    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
    end Interfaces;

    package Sources
      block RealExpression Modelica.Blocks.Interfaces.RealOutput y=0.0; end RealExpression;
    end Sources;
  end Blocks;

  package Mechanics
    package Translational
      package Interfaces
        connector Flange_a Modelica.Units.SI.Position s; flow Modelica.Units.SI.Force f; end Flange_a;
        connector Flange_b Modelica.Units.SI.Position s; flow Modelica.Units.SI.Force f; end Flange_b;

        partial model PartialTwoFlanges Flange_a flange_a; Flange_b flange_b; end PartialTwoFlanges;

        partial model PartialCompliant
          extends PartialTwoFlanges;
          Modelica.Units.SI.Position s_rel(start=0);
          Modelica.Units.SI.Force f;
        equation
          s_rel = flange_b.s - flange_a.s;
          flange_b.f = f;
          flange_a.f = -f;
        end PartialCompliant;

        partial model PartialCompliantWithRelativeStates
          extends PartialTwoFlanges;
          parameter StateSelect stateSelect=StateSelect.prefer;
          parameter Modelica.Units.SI.Length s_nominal=1e-4;
          Modelica.Units.SI.Position s_rel(start=0, stateSelect=stateSelect, nominal=s_nominal);
          Modelica.Units.SI.Velocity v_rel(start=0, stateSelect=stateSelect);
          Modelica.Units.SI.Force f;
        equation
          s_rel = flange_b.s - flange_a.s;
          v_rel = der(s_rel);
          flange_b.f = f;
          flange_a.f = -f;
        end PartialCompliantWithRelativeStates;
      end Interfaces;

      package Components
        model Fixed
          parameter Modelica.Units.SI.Position s0=0;
          Interfaces.Flange_b flange;
        equation
          flange.s = s0;
        end Fixed;
      end Components;

      package Sources
        model Position
          parameter Boolean exact=false "Must be true in this stub";
          Interfaces.Flange_b flange;
          Modelica.Blocks.Interfaces.RealInput s_ref;
        equation
          flange.s = s_ref;
        end Position;
      end Sources;
    end Translational;
  end Mechanics;
end Modelica;
