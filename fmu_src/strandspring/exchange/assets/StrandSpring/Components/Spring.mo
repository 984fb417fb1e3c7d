within StrandSpring.Components;
model Spring "Hysteretic spring between two flanges, as equations"
  extends Modelica.Mechanics.Translational.Interfaces.PartialCompliantWithRelativeStates;
  parameter StrandSpring.Records.SpringData data "Parameters of the spring"
    annotation (choicesAllMatching=true);
  parameter Modelica.Units.SI.Position s_rel0(displayUnit="mm")=0 "s_rel at which the displacement is 0";
  Modelica.Units.SI.Position displacement(displayUnit="mm") "Displacement as the FMU of the spring counts it";
  Real omega(final unit="1", start=data.omega_start, fixed=true)
    "Normalized hysteretic variable: 1 when saturated in loading, -1 in unloading";
  Real second_omega(final unit="1", start=data.second_omega_start, fixed=true) "omega of the second mechanism";
  Modelica.Units.SI.Position elongation[size(data.branch_stiffness, 1)](each start=0, each fixed=true)
    "Elongation of the spring of each Maxwell branch";
  Modelica.Units.SI.Energy absorbed_energy(start=0, fixed=true)
    "Integral of the force over the displacement since the start";
  Boolean extrapolating "True outside the identified range, where FE continues along its tangent and FA is constant";
protected
  Modelica.Units.SI.Position limited "Displacement, limited to the identified range";
  Modelica.Units.SI.Position x "The same from displacement_offset";
  Modelica.Units.SI.Force FE "Elastic force: a spline, or a polynomial";
  Real FA(final unit="1") "Amplifier of the hysteretic force";
equation
  displacement = s_rel - s_rel0;
  extrapolating = displacement < data.displacement_min or displacement > data.displacement_max;
  limited = min(max(displacement, data.displacement_min), data.displacement_max);
  x = limited - data.displacement_offset;
  FE = if size(data.FE_knots, 1) > 1 then
    StrandSpring.Functions.spline(data.FE_knots, data.FE_forces, data.FE_slopes, displacement)
    else StrandSpring.Functions.polynomial(data.kE, x)
    + StrandSpring.Functions.polynomialSlope(data.kE, x)*(displacement - limited);
  FA = StrandSpring.Functions.polynomial(data.kA, x);
  der(omega) = data.rho*StrandSpring.Functions.slip(omega, v_rel, data.sigma, data.n);
  der(second_omega) = data.second_rho*StrandSpring.Functions.slip(second_omega, v_rel, data.second_sigma, data.second_n);
  for i in 1:size(data.branch_stiffness, 1) loop
    der(elongation[i]) = v_rel - elongation[i]/data.branch_time_constant[i];
  end for;
  f = FE + data.kappa_omega*omega*FA
    + data.second_kappa_omega*second_omega*StrandSpring.Functions.polynomial(data.second_kA, x)
    + StrandSpring.Functions.branches(data.branch_stiffness, elongation);
  der(absorbed_energy) = f*v_rel;
  assert(not extrapolating, "The displacement of the spring has left the identified range; its force is extrapolated.",
    level=AssertionLevel.warning);
  annotation (
    Documentation(info="<html>
<p>
The modified normalized Bouc-Wen model of Zhao et al., see
<a href=\"modelica://StrandSpring.UsersGuide.Model\">UsersGuide.Model</a> for its equations and
<a href=\"modelica://StrandSpring.UsersGuide.Conventions\">UsersGuide.Conventions</a> for signs and coordinates.
Give data one of the <a href=\"modelica://StrandSpring.Records\">Records</a>.
</p>
<p>
States are s_rel and v_rel, as those of the base class, omega, second_omega, absorbed_energy and the elongations of the
branches. Simulate with a relative tolerance of
1e-6 or less. The relative position of the flanges must be differentiable, as that of masses is.
</p>
</html>"),
    Icon(graphics={
      Line(points={{-100,0},{-70,0},{-50,40},{-20,-40},{10,40},{40,-40},{60,0},{100,0}}, color={0,127,0}),
      Line(points={{-40,-90},{-10,-86},{20,-74},{40,-50}}, color={0,127,0}, smooth=Smooth.Bezier),
      Line(points={{40,-50},{10,-54},{-20,-66},{-40,-90}}, color={0,127,0}, smooth=Smooth.Bezier),
      Text(extent={{-150,90},{150,50}}, textString="%name", textColor={0,0,255})}));
end Spring;
