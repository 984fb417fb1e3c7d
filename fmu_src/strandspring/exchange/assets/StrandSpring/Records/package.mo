within StrandSpring;
package Records "Parameters of identified springs"
  extends Modelica.Icons.RecordsPackage;
  annotation (Documentation(info="<html>
<p>
Each record holds one spring and extends <a href=\"modelica://StrandSpring.Records.SpringData\">SpringData</a>.
<code>strandspring export MODEL.json --modelica</code> adds a record for a model file, or replaces the record of that
name.
</p>
</html>"));
end Records;
