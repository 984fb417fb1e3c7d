within StrandSpring.Examples;
model Transmissibility "A mass on the spring above a base that vibrates harmonically"
  extends Modelica.Icons.Example;
  parameter StrandSpring.Records.SpringData data=StrandSpring.Records.StrandedWireMount() "Parameters of the spring"
    annotation (choicesAllMatching=true);
  constant Real pi=Modelica.Constants.pi;
  parameter Modelica.Units.SI.Mass m=5 "Mass on the spring";
  parameter Modelica.Units.SI.Force load=50 "Constant force on the mass, such as its weight";
  parameter Modelica.Units.SI.Frequency frequency=20 "Frequency of the base";
  parameter Modelica.Units.SI.Length amplitude(displayUnit="mm")=0.001 "Amplitude of the base";
  parameter Integer settling=40 "Periods before transmissibility is measured";
  parameter Integer measured=10 "Periods over which it is measured";
  Real transmissibility(final unit="1")
    "Amplitude of the mass over that of the base at the frequency of the base; 0 until it is measured";
  StrandSpring.Components.Spring spring(data=data)
    annotation (Placement(transformation(extent={{-10,-10},{10,10}})));
  Modelica.Blocks.Sources.RealExpression motion(
    y=-amplitude*(2*pi*frequency)^2*sin(2*pi*frequency*time))
    annotation (Placement(transformation(extent={{-90,-10},{-70,10}})));
  Modelica.Mechanics.Translational.Sources.Accelerate base(v(start=2*pi*frequency*amplitude, fixed=true))
    annotation (Placement(transformation(extent={{-50,-10},{-30,10}})));
  Modelica.Mechanics.Translational.Components.Mass mass(m=m, s(start=0, fixed=true), v(start=0, fixed=true))
    annotation (Placement(transformation(extent={{30,-10},{50,10}})));
  Modelica.Mechanics.Translational.Sources.ConstantForce force(f_constant=load)
    annotation (Placement(transformation(extent={{90,-10},{70,10}})));
protected
  parameter Modelica.Units.SI.Time begin=settling/frequency;
  parameter Modelica.Units.SI.Time finish=(settling + measured)/frequency;
  Real weight "2/(measured periods*amplitude) while it is measured, else 0";
  Real sine(start=0, fixed=true) "Part of the motion of the mass in phase with the base";
  Real cosine(start=0, fixed=true) "Part of the motion of the mass ahead by a quarter of a period";
equation
  weight = if time >= begin and time < finish then 2*frequency/(measured*amplitude) else 0;
  der(sine) = weight*mass.s*sin(2*pi*frequency*time);
  der(cosine) = weight*mass.s*cos(2*pi*frequency*time);
  transmissibility = if time < finish then 0 else sqrt(sine^2 + cosine^2);
  connect(motion.y, base.a_ref) annotation (Line(points={{-69,0},{-52,0}}, color={0,0,127}));
  connect(base.flange, spring.flange_a) annotation (Line(points={{-30,0},{-10,0}}, color={0,127,0}));
  connect(spring.flange_b, mass.flange_a) annotation (Line(points={{10,0},{30,0}}, color={0,127,0}));
  connect(mass.flange_b, force.flange) annotation (Line(points={{50,0},{70,0}}, color={0,127,0}));
  annotation (
    experiment(StopTime=2.6, Interval=0.001, Tolerance=1e-8),
    Documentation(info="<html>
<p>
The base moves as amplitude*sin(2*pi*frequency*time), given to it as an acceleration, and the mass follows through the
spring. After a number of periods for settling, transmissibility is found at the frequency of the base by a Fourier
integral over the next periods, and holds from then on. Because the stiffness and the damping of the spring
depend on the stroke, so does transmissibility: a larger amplitude lowers the resonance.
</p>
<p>
If the frequency is changed, StopTime must be at least (settling + measured)/frequency.
</p>
</html>",
      figures={Figure(title="Motion of base and mass", identifier="motion", preferred=true, plots={
        Plot(curves={Curve(y=base.s), Curve(y=mass.s)})})}));
end Transmissibility;
