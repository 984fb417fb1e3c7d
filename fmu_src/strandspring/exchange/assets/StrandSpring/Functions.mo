within StrandSpring;
package Functions "Slip of a friction mechanism, polynomial and cubic spline"
  extends Modelica.Icons.FunctionsPackage;

  function polynomial "Polynomial with coefficients of ascending powers"
    extends Modelica.Icons.Function;
    input Real c[:] "Coefficients of ascending powers of x";
    input Real x;
    output Real y "c[1] + c[2]*x + c[3]*x^2 + ...";
  algorithm
    y := 0;
    for i in size(c, 1):-1:1 loop
      y := c[i] + x*y;
    end for;
    annotation (smoothOrder=2);
  end polynomial;

  function polynomialSlope "Derivative of polynomial(c, x) with respect to x"
    extends Modelica.Icons.Function;
    input Real c[:] "Coefficients of ascending powers of x";
    input Real x;
    output Real y "c[2] + 2*c[3]*x + 3*c[4]*x^2 + ...";
  algorithm
    y := 0;
    for i in size(c, 1):-1:2 loop
      y := (i - 1)*c[i] + x*y;
    end for;
    annotation (smoothOrder=2);
  end polynomialSlope;

  function spline "Cubic spline through points with given slopes, along its tangents outside"
    extends Modelica.Icons.Function;
    input Real knots[:] "Increasing positions of the points";
    input Real values[size(knots, 1)] "Values at the knots";
    input Real slopes[size(knots, 1)] "Slopes at the knots";
    input Real x;
    output Real y;
  protected
    Integer last=size(knots, 1);
    Integer i "Last knot but one that is not above x";
    Real inside "x, limited to the knots";
    Real width "Distance from knot i to the next";
    Real t "Place between these knots, from 0 to 1";
    Real rise "Difference of their values";
  algorithm
    inside := min(max(x, knots[1]), knots[last]);
    i := 1;
    for k in 2:last - 1 loop
      if inside >= knots[k] then
        i := k;
      end if;
    end for;
    width := knots[i + 1] - knots[i];
    t := (inside - knots[i])/width;
    rise := values[i + 1] - values[i];
    y := values[i] + t*(width*slopes[i] + t*(3*rise - width*(2*slopes[i] + slopes[i + 1])
      + t*(width*(slopes[i] + slopes[i + 1]) - 2*rise)))
      + (if x < inside then slopes[1] else slopes[last])*(x - inside);
    annotation (smoothOrder=1);
  end spline;

  function branches "Force of the springs of Maxwell branches"
    extends Modelica.Icons.Function;
    input Real stiffness[:];
    input Real elongation[size(stiffness, 1)];
    output Real force;
  algorithm
    force := 0;
    for i in 1:size(stiffness, 1) loop
      force := force + stiffness[i]*elongation[i];
    end for;
    annotation (smoothOrder=2);
  end branches;

  function slip "Rate of omega over rho"
    extends Modelica.Icons.Function;
    input Real omega;
    input Real v "Rate of the displacement";
    input Real sigma;
    input Real n;
    output Real rate;
  protected
    constant Real least=1e-10 "|omega| below which the derivative of |omega|^n is kept finite";
    Real w "|omega|^n";
  algorithm
    w := abs(omega)*(abs(omega) + least)^(n - 1);
    rate := if v*omega >= 0 then v*(1 - w) else v*(1 + (2*sigma - 1)*w);
    annotation (smoothOrder=0);
  end slip;
  annotation (Documentation(info="<html>
<p>
What the elastic force, the amplifiers and the hysteresis of a spring are made of. They are called by
<a href=\"modelica://StrandSpring.Components.Spring\">Components.Spring</a> and can be used on their own.
</p>
</html>"));
end Functions;
