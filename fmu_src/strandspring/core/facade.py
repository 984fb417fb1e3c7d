"""What the slave takes from pythonfmu.

In an FMU this file is replaced by `INSIDE_FMU`, so that each FMU runs its own copy of pythonfmu under its own
package name and never one that the host or another FMU has imported before.
"""

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

INSIDE_FMU = """\
from ..pythonfmu.enums import Fmi2Status
from ..pythonfmu.fmi2slave import Fmi2Slave

__all__ = ["Fmi2Slave", "Fmi2Status"]
"""

__all__ = ["INSIDE_FMU", "Fmi2Slave", "Fmi2Status"]
