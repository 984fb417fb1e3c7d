within StrandSpring;
package Examples "Examples that can be simulated as they are"
  extends Modelica.Icons.ExamplesPackage;
  annotation (Documentation(info="<html>
<p>
The examples have the spring <a href=\"modelica://StrandSpring.Records.StrandedWireMount\">StrandedWireMount</a>. For
another one, extend the example and give the spring's record, and a mass and amplitudes that suit it:
</p>
<pre>
model FreeDecayOfMine
  extends StrandSpring.Examples.FreeDecay(data=StrandSpring.Records.mine(), m=0.4, s_start=0.002);
end FreeDecayOfMine;
</pre>
</html>"));
end Examples;
