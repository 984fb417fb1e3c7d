within StrandSpring;
package Components "The spring as equations, and flanges for its FMU"
  extends Modelica.Icons.Package;
  annotation (Documentation(info="<html>
<p>
<a href=\"modelica://StrandSpring.Components.Spring\">Spring</a> needs nothing but this library.
<a href=\"modelica://StrandSpring.Components.FMUFlanges\">FMUFlanges</a> puts the FMU of a spring, imported by the
simulator, between two flanges.
</p>
</html>"));
end Components;
