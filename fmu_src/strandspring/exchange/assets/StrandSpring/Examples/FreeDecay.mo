within StrandSpring.Examples;
model FreeDecay "Free decay of a mass that is released on the spring"
  extends Modelica.Icons.Example;
  parameter StrandSpring.Records.SpringData data=StrandSpring.Records.StrandedWireMount() "Parameters of the spring"
    annotation (choicesAllMatching=true);
  parameter Modelica.Units.SI.Mass m=5 "Mass on the spring";
  parameter Modelica.Units.SI.Force load=50 "Constant force on the mass, such as its weight";
  parameter Modelica.Units.SI.Position s_start(displayUnit="mm")=0.01 "Where the mass is released";
  StrandSpring.Components.Spring spring(data=data)
    annotation (Placement(transformation(extent={{-30,-10},{-10,10}})));
  Modelica.Mechanics.Translational.Components.Fixed fixed
    annotation (Placement(transformation(extent={{-70,-10},{-50,10}})));
  Modelica.Mechanics.Translational.Components.Mass mass(m=m, s(start=s_start, fixed=true), v(start=0, fixed=true))
    annotation (Placement(transformation(extent={{10,-10},{30,10}})));
  Modelica.Mechanics.Translational.Sources.ConstantForce force(f_constant=load)
    annotation (Placement(transformation(extent={{70,-10},{50,10}})));
equation
  connect(fixed.flange, spring.flange_a) annotation (Line(points={{-60,0},{-30,0}}, color={0,127,0}));
  connect(spring.flange_b, mass.flange_a) annotation (Line(points={{-10,0},{10,0}}, color={0,127,0}));
  connect(mass.flange_b, force.flange) annotation (Line(points={{30,0},{50,0}}, color={0,127,0}));
  annotation (
    experiment(StopTime=1, Interval=0.001, Tolerance=1e-8),
    Documentation(info="<html>
<p>
A mass under a constant load is released at s_start and swings about its static equilibrium. There is no damper: the
hysteresis of the spring alone takes the energy, and the amplitude falls cycle by cycle. The spring holds the mass where
the swing has died out, which depends on the path.
</p>
</html>",
      figures={Figure(title="Free decay", identifier="decay", preferred=true, plots={
        Plot(curves={Curve(y=mass.s)})})}));
end FreeDecay;
