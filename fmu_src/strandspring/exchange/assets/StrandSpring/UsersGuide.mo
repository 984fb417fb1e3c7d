within StrandSpring;
package UsersGuide "User's Guide"
  extends Modelica.Icons.Information;

  class Model "The model and its equations"
    extends Modelica.Icons.Information;
    annotation (Documentation(info="<html>
<p>
With x = displacement - displacement_offset the force of the spring is
</p>
<p>
f = FE(x) + kappa_omega*omega*FA(x),<br>
der(omega) = rho*der(x)*(1 - (sigma*sign(der(x))*sign(omega) - sigma + 1)*|omega|<sup>n</sup>).
</p>
<table border=\"1\" cellspacing=\"0\" cellpadding=\"2\">
<tr><td>FE</td><td>elastic force: a polynomial with the coefficients kE, or a cubic spline through FE_forces at
FE_knots</td></tr>
<tr><td>FA</td><td>amplifier of the hysteretic force: a polynomial with the coefficients kA, 1 at x = 0</td></tr>
<tr><td>omega</td><td>normalized hysteretic variable, from -1 (saturated in unloading) to 1 (in loading)</td></tr>
<tr><td>kappa_omega</td><td>saturated hysteretic force at x = 0</td></tr>
<tr><td>rho</td><td>slope of omega over x where omega is 0</td></tr>
<tr><td>sigma</td><td>recovery of omega after a reversal: its slope there is 2*sigma*rho</td></tr>
<tr><td>n</td><td>smoothness of the transition to saturation</td></tr>
</table>
<p>
This is rate independent: force depends on the path of the displacement, not on how fast it is followed. A record may
add a second mechanism, second_kappa_omega*second_omega*FA2(x), with its own omega by the same equation, and Maxwell
branches, branch_stiffness*elongation each, with der(elongation) = der(x) - elongation/branch_time_constant. Outside the identified range, from displacement_min to displacement_max, FE continues along its tangent and FA is constant;
extrapolating is then true and a warning is logged.
</p>
<p>
Here the simulator integrates omega within its tolerance. The FMU of the same spring uses the closed form instead,
which is exact for any step. Force and omega of the two differ by the simulator's error, for which a relative
tolerance of 1e-6 or less is recommended.
</p>
</html>"));
  end Model;

  class Conventions "Signs, coordinates and names"
    extends Modelica.Icons.Information;
    annotation (Documentation(info="<html>
<p>
<strong>Signs.</strong> Displacement and force have the signs of
Modelica.Mechanics.Translational.Interfaces.PartialCompliantWithRelativeStates: s_rel = flange_b.s - flange_a.s, and a
positive f accelerates a mass at flange_b towards smaller s. If compression is positive in the record, exchange
flange_a and flange_b and set s_rel0 = -(distance of the flanges at displacement 0).
</p>
<p>
<strong>Coordinates.</strong> displacement = s_rel - s_rel0 is counted as the FMU of the same spring counts it. The
documentation of each record says where 0 lies on the measured record.
</p>
<p>
<strong>Names.</strong> The parameters are those of the FMU. Arrays begin at 1 here and at 0 there: kE[1] is kE_0.
</p>
<p>
<strong>Start.</strong> The path starts at the displacement that holds at the start of the simulation, with omega =
omega_start and absorbed_energy = 0.
</p>
</html>"));
  end Conventions;

  class References "References"
    extends Modelica.Icons.References;
    annotation (Documentation(info="<html>
<ul>
<li>Zhao et al.: modified normalized Bouc-Wen model of stranded wire helical springs, Journal of Vibroengineering
15(1), 2013, eqs. (8) to (11).</li>
<li>R. Bouc: Forced vibration of mechanical systems with hysteresis, Proceedings of the Fourth Conference on Nonlinear
Oscillation, Prague, 1967.</li>
<li>Y.-K. Wen: Method for random vibration of hysteretic systems, Journal of the Engineering Mechanics Division, ASCE,
102(2), 1976.</li>
</ul>
</html>"));
  end References;

  annotation (preferredView="info", Documentation(info="<html>
<p>
A spring of this library is a component between two translational flanges together with a record of its parameters:
</p>
<pre>
StrandSpring.Components.Spring spring(data=StrandSpring.Records.StrandedWireMount());
</pre>
<p>
The following pages describe its equations, its conventions and where they come from.
</p>
</html>"));
end UsersGuide;
