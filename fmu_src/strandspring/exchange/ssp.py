"""A system of SSP 1.0: the FMU of a spring under a mass above a shaking base, each with its parameter values.

The values are start values of the FMUs, for tools that apply no parameter sets, and bound to the components, so that
the others apply what is edited there.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

from ..core.variables import FmiUnit
from ..errors import StrandspringError
from ..fmu.archive import licences, write_archive
from ..fmu.description.described_variables import start_omegas
from ..fmu.description.ssv import Row, parameter_rows, parameter_set, parameter_values
from ..fmu.python_backed import slave_contents
from ..ground.scratch import TemporaryFolder
from ..kernel.path import PathSolver, as_path
from ..model.modelfile import ModelFile

_UNITS = (
    FmiUnit("kg", kg=1),
    FmiUnit("m", m=1),
    FmiUnit("N", kg=1, m=1, s=-2),
    FmiUnit("Hz", s=-1),
)
_PERIODS = 10
# For OMSimulator, whose program reads the element FixedStepMaster, and whose Python interface the attributes around it;
# the name is that of its default. Forces that are held over a step feed energy in, so that steps must be short.
_STEPS_A_PERIOD = 5000

_STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="{name}">
  <ssd:System name="{name}">
    <ssd:Elements>
      <ssd:Component name="plant" type="application/x-fmu-sharedlibrary" source="resources/plant.fmu">
        <ssd:Connectors>
          <ssd:Connector name="force" kind="input"><ssc:Real unit="N"/></ssd:Connector>
          <ssd:Connector name="displacement" kind="output"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="position" kind="output"><ssc:Real unit="m"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings><ssd:ParameterBinding source="resources/plant.ssv"/></ssd:ParameterBindings>
      </ssd:Component>
      <ssd:Component name="spring" type="application/x-fmu-sharedlibrary" source="resources/spring.fmu">
        <ssd:Connectors>
          <ssd:Connector name="displacement" kind="input"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="force" kind="output"><ssc:Real unit="N"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings><ssd:ParameterBinding source="resources/spring.ssv"/></ssd:ParameterBindings>
      </ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="plant" startConnector="displacement"
                      endElement="spring" endConnector="displacement"/>
      <ssd:Connection startElement="spring" startConnector="force"
                      endElement="plant" endConnector="force"/>
    </ssd:Connections>
    <ssd:Annotations>
      <ssc:Annotation type="org.openmodelica">
        <oms:Annotations xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd">
          <oms:SimulationInformation name="oms_ma_default" method="oms_ma" fixedStepSize="{step:.12f}">
            <oms:FixedStepMaster description="oms-ma" stepSize="{step:.12f}" relativeTolerance="0.0001"/>
          </oms:SimulationInformation>
        </oms:Annotations>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:System>
  <ssd:Units>
    <ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
    <ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit>
  </ssd:Units>
  <ssd:DefaultExperiment startTime="0.0" stopTime="{stop!r}"/>
</ssd:SystemStructureDescription>
"""


@dataclass(frozen=True)
class ShakenMassValues:
    """A mass on the spring under a constant load, above a base that moves as amplitude*sin(2 pi frequency t).

    Parameters
    ----------
    mass, load, amplitude, frequency : float   [kg], [N], [m], [Hz].
    """

    mass: float
    load: float
    amplitude: float
    frequency: float

    @classmethod
    def suited(cls, model: ModelFile, mass: float) -> ShakenMassValues:
        """A mass in equilibrium where the FMU starts, shaken by 1 % of the range at the resonance of small motion.

        Raises
        ------
        StrandspringError   If displacement 0 lies outside the identified range.
        """
        spring = model.parameters
        low, high = spring.displacement_min, spring.displacement_max
        if not low <= 0.0 <= high:
            raise StrandspringError(
                "The system starts at 0 mm, outside the identified range {range:.6g mm}; choose {to[zero]} within it.",
                range=((low, high),),
            )
        still, origin = PathSolver(spring).slow, as_path([0.0])
        stiffness = max(still.stiffness(origin, 0.0)[0], spring.kappa_omega * spring.rho)
        frequency = math.sqrt(stiffness / mass) / (2.0 * math.pi)
        return cls(mass, float(still.force(origin, start_omegas(model))[0]), 0.01 * (high - low), frequency)

    @property
    def rows(self) -> list[Row]:
        """The parameters of the plant."""
        about = {
            "mass": ("Mass on the spring", "kg"),
            "load": ("Constant force on the mass; the default holds the spring at displacement 0", "N"),
            "amplitude": ("Amplitude of the base", "m"),
            "frequency": ("Frequency of the base", "Hz"),
        }
        return [(name, *about[name], value) for name, value in asdict(self).items()]


def write_system(path: Path, spring: Path, model: ModelFile, plant: ShakenMassValues) -> Path:
    """Write an .ssp file; the same arguments give the same bytes.

    Parameters
    ----------
    path : Path
    spring : Path        The FMU of the spring.
    model : ModelFile    What is applied to it, with its displacement counted as by the FMU.
    plant : ShakenMassValues

    Returns
    -------
    Path                 `path`.

    Raises
    ------
    StrandspringError    If the file cannot be written.
    """
    period = 1.0 / plant.frequency
    step = float(f"{period / _STEPS_A_PERIOD:.1g}")
    structure = _STRUCTURE.format(name=model.name, stop=_PERIODS * period, step=step)
    about, (of_spring, known) = "A mass above a base that vibrates harmonically", parameter_rows(model)
    # Of the whole system, for tools that take such a set where they simulate, as FMPy does.
    named = {"spring": of_spring, "plant": plant.rows}
    of_system = [(f"{component}.{row[0]}", *row[1:]) for component, rows in named.items() for row in rows]
    units = {unit.name: unit for unit in (*known, *_UNITS)}.values()
    contents = {
        "SystemStructure.ssd": structure.encode("utf-8"),
        "resources/spring.fmu": spring.read_bytes(),
        "resources/spring.ssv": parameter_values(model).encode("utf-8"),
        "resources/plant.ssv": parameter_set("plant", about, plant.rows, _UNITS).encode("utf-8"),
        "resources/system.ssv": parameter_set(model.name, about, of_system, units).encode("utf-8"),
    }
    with TemporaryFolder() as folder:
        contents["resources/plant.fmu"] = _plant_fmu(folder / "plant.fmu", plant).read_bytes()
    return write_archive(path, contents)


def _plant_fmu(path: Path, plant: ShakenMassValues) -> Path:
    """Write the FMU of the plant, a slave of PythonFMU as our Python-backed FMUs are, with these start values."""
    values = asdict(plant)
    form = (files(__package__) / "assets" / "shaken_mass.xml").read_text(encoding="utf-8")
    description = form.format(guid="", **values).encode("utf-8")
    source = (files(__package__) / "shaken_mass_slave.py").read_text(encoding="utf-8")
    module = source.replace("from pythonfmu.", "from <package>.pythonfmu.") + f"\n\nShakenMass.values = {values!r}\n"
    guid, contents = slave_contents("ShakenMass", module, description)
    described = form.format(guid=guid, **values).encode("utf-8")
    return write_archive(path, {"modelDescription.xml": described, **licences(("pythonfmu",)), **contents})
