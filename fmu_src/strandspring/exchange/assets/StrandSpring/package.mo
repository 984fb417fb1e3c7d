within ;
package StrandSpring "Hysteretic springs identified from measurement"
  extends Modelica.Icons.Package;

  annotation (
    version="@version@",
    uses(Modelica(version="4.0.0")),
    preferredView="info",
    Documentation(info="<html>
<p>
Stranded wire springs, wire-rope isolators, rubber mounts and friction dampers, whose force depends on the path of the
displacement: the modified normalized Bouc-Wen model of Zhao et al., identified from force-displacement records by
strandspring.
</p>
<ul>
<li><a href=\"modelica://StrandSpring.UsersGuide\">UsersGuide</a>: the model, its conventions, references.</li>
<li><a href=\"modelica://StrandSpring.Examples\">Examples</a> that can be simulated as they are.</li>
<li><a href=\"modelica://StrandSpring.Components.Spring\">Components.Spring</a>: the spring as equations.</li>
<li><a href=\"modelica://StrandSpring.Components.FMUFlanges\">Components.FMUFlanges</a>: flanges for the FMU of a
spring.</li>
<li><a href=\"modelica://StrandSpring.Records\">Records</a>: one record of parameters per identified spring.</li>
</ul>
<p>
Written by strandspring @version@. Exporting another spring into the same folder adds its record; everything but the
records is then written again, so changes to it are lost.
</p>
</html>"),
    Icon(graphics={
      Line(points={{-80,-66},{-44,-58},{-6,-40},{30,-8},{58,36},{72,74}}, color={0,127,0}, thickness=1.0,
        smooth=Smooth.Bezier),
      Line(points={{72,74},{34,62},{-4,42},{-40,10},{-66,-30},{-80,-66}}, color={0,127,0}, thickness=1.0,
        smooth=Smooth.Bezier)}));
end StrandSpring;
