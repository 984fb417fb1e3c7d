within StrandSpring.Records;
record SpringData "Parameters of a spring; element i of an array is element i-1 of the FMU"
  extends Modelica.Icons.Record;
  parameter Real kE[:]
    "Elastic force FE: coefficients of ascending powers of (displacement - displacement_offset); kE[i] in N/m^(i-1)";
  parameter Modelica.Units.SI.Position FE_knots[:](each displayUnit="mm")
    "Elastic force FE: displacements at the knots of its cubic spline";
  parameter Modelica.Units.SI.Force FE_forces[size(FE_knots, 1)] "Elastic force FE at the knots";
  parameter Modelica.Units.SI.TranslationalSpringConstant FE_slopes[size(FE_knots, 1)]
    "Slope of FE at the knots, which makes the spline twice differentiable; belongs to FE_forces";
  parameter Real kA[:]
    "Amplifier FA: coefficients of ascending powers of (displacement - displacement_offset); kA[i] in 1/m^(i-1)";
  parameter Modelica.Units.SI.Force kappa_omega(min=1e-15, max=1e15) "Saturated hysteretic force at displacement_offset";
  parameter Real rho(final unit="1/m", min=0.0) "Slope of omega over displacement at its zero crossing";
  parameter Real sigma(final unit="1", min=0.5, max=1000.0) "Recovery of omega after a reversal";
  parameter Real n(final unit="1", min=0.01, max=100.0) "Smoothness exponent of the transition to saturation";
  parameter Modelica.Units.SI.Position displacement_offset(displayUnit="mm")
    "Displacement about which FE and FA are written";
  parameter Modelica.Units.SI.Position displacement_min(displayUnit="mm") "Lower end of the identified range";
  parameter Modelica.Units.SI.Position displacement_max(displayUnit="mm") "Upper end of the identified range";
  parameter Real omega_start(final unit="1", min=-1.0, max=1.0)=0.0 "omega where the path starts";
  parameter Real second_kA[:] "Second mechanism: its amplifier, like kA; 0 where there is none";
  parameter Modelica.Units.SI.Force second_kappa_omega(min=0.0, max=1e15)=0.0
    "Second mechanism: its saturated force at displacement_offset";
  parameter Real second_rho(final unit="1/m", min=0.0)=0.0 "Second mechanism: its rho";
  parameter Real second_sigma(final unit="1", min=0.5, max=1000.0)=1.0 "Second mechanism: its sigma";
  parameter Real second_n(final unit="1", min=0.01, max=100.0)=1.0 "Second mechanism: its n";
  parameter Real second_omega_start(final unit="1", min=-1.0, max=1.0)=0.0 "second_omega where the path starts";
  parameter Modelica.Units.SI.TranslationalSpringConstant branch_stiffness[:]
    "Maxwell branches: stiffness of the spring of each";
  parameter Modelica.Units.SI.Time branch_time_constant[size(branch_stiffness, 1)]
    "Maxwell branches: time constant of each";
  annotation (Documentation(info="<html>
<p>
Base of the records of <a href=\"modelica://StrandSpring.Records\">Records</a>. The elastic force is either a polynomial
with the coefficients kE or a spline through FE_forces at FE_knots; the arrays of the other are empty.
</p>
</html>"));
end SpringData;
