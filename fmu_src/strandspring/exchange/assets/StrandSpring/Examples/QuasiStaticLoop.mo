within StrandSpring.Examples;
model QuasiStaticLoop "Force over displacement while the displacement swings slowly with falling amplitude"
  extends Modelica.Icons.Example;
  parameter StrandSpring.Records.SpringData data=StrandSpring.Records.StrandedWireMount() "Parameters of the spring"
    annotation (choicesAllMatching=true);
  parameter Modelica.Units.SI.Position middle(displayUnit="mm")=0 "About which the displacement swings";
  parameter Modelica.Units.SI.Length amplitude(displayUnit="mm")=0.025 "Amplitude at the start";
  StrandSpring.Components.Spring spring(data=data)
    annotation (Placement(transformation(extent={{-10,-10},{10,10}})));
  Modelica.Mechanics.Translational.Components.Fixed fixed
    annotation (Placement(transformation(extent={{-50,-10},{-30,10}})));
  Modelica.Blocks.Sources.RealExpression motion(
    y=middle + amplitude*exp(-0.02*time)*sin(0.2*Modelica.Constants.pi*time))
    annotation (Placement(transformation(extent={{90,-10},{70,10}})));
  Modelica.Mechanics.Translational.Sources.Position machine(exact=true)
    annotation (Placement(transformation(extent={{50,-10},{30,10}})));
equation
  connect(fixed.flange, spring.flange_a) annotation (Line(points={{-40,0},{-10,0}}, color={0,127,0}));
  connect(spring.flange_b, machine.flange) annotation (Line(points={{10,0},{30,0}}, color={0,127,0}));
  connect(motion.y, machine.s_ref) annotation (Line(points={{69,0},{52,0}}, color={0,0,127}));
  annotation (
    experiment(StopTime=40, Interval=0.02, Tolerance=1e-8),
    Documentation(info="<html>
<p>
A testing machine moves one end of the spring through four cycles of falling amplitude. Plotted over spring.displacement,
spring.f is a spiral of nested loops; the area of each is the energy that the spring absorbs in it.
</p>
</html>",
      figures={Figure(title="Hysteresis loops", identifier="loops", preferred=true, plots={
        Plot(curves={Curve(x=spring.displacement, y=spring.f)})})}));
end QuasiStaticLoop;
