within StrandSpring.Components;
model FMUFlanges "Flanges for the FMU of a spring, which is connected to their displacement and force"
  extends Modelica.Mechanics.Translational.Interfaces.PartialCompliant;
  parameter Modelica.Units.SI.Position s_rel0(displayUnit="mm")=0 "s_rel at which the displacement is 0";
  Modelica.Blocks.Interfaces.RealOutput displacement(final unit="m", displayUnit="mm")
    "Connect to the input `displacement` of the FMU"
    annotation (Placement(transformation(origin={-60,-110}, extent={{-10,-10},{10,10}}, rotation=-90)));
  Modelica.Blocks.Interfaces.RealInput force(final unit="N") "Connect to the output `force` of the FMU"
    annotation (Placement(transformation(origin={60,-120}, extent={{-20,-20},{20,20}}, rotation=90)));
equation
  displacement = s_rel - s_rel0;
  f = force;
  annotation (
    Documentation(info="<html>
<p>
Import the FMU with the simulator's own command, place the resulting block beside this model, and connect displacement
to displacement and force to force. Each flange must be connected to a mass or a prescribed motion: the FMU computes
the force from the displacement, not the displacement from the force.
</p>
</html>"),
    Icon(graphics={
      Rectangle(extent={{-80,40},{80,-100}}, lineColor={0,127,0}, fillColor={255,255,255},
        fillPattern=FillPattern.Solid),
      Line(points={{-100,0},{-80,0}}, color={0,127,0}),
      Line(points={{80,0},{100,0}}, color={0,127,0}),
      Text(extent={{-70,20},{70,-60}}, textString="FMU", textColor={0,127,0}),
      Text(extent={{-150,90},{150,50}}, textString="%name", textColor={0,0,255})}));
end FMUFlanges;
