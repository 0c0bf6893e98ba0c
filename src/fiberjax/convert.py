"""Fibers from other systems' numbers, and those numbers from fibers.

One function per system, with that system's names, units, defaults and clamps; `to_` it
where it is one-to-one. What a system or a `Fiber` cannot represent is an error that
says what is lost. No tangent is turned: alpha is along that of the system.
"""

from fiberjax.engines import Unity as Unity
from fiberjax.engines import to_unity as to_unity
from fiberjax.engines import unity as unity
from fiberjax.farfields import Tungsten as Tungsten
from fiberjax.farfields import to_tungsten as to_tungsten
from fiberjax.farfields import tungsten as tungsten
from fiberjax.mitsuba3 import Mitsuba as Mitsuba
from fiberjax.mitsuba3 import mitsuba as mitsuba
from fiberjax.mitsuba3 import to_mitsuba as to_mitsuba
from fiberjax.nodes import MaterialX as MaterialX
from fiberjax.nodes import materialx as materialx
from fiberjax.nodes import materialx_roughness as materialx_roughness
from fiberjax.nodes import to_materialx as to_materialx
from fiberjax.pathtracers import Pbrt as Pbrt
from fiberjax.pathtracers import pbrt as pbrt
from fiberjax.pathtracers import to_pbrt as to_pbrt
from fiberjax.principled import Cycles as Cycles
from fiberjax.principled import cycles as cycles
from fiberjax.principled import to_cycles as to_cycles
from fiberjax.rtx import Rtxcr as Rtxcr
from fiberjax.rtx import rtxcr as rtxcr
from fiberjax.rtx import to_rtxcr as to_rtxcr
from fiberjax.unreal import Karis as Karis
from fiberjax.unreal import karis as karis
from fiberjax.unreal import to_karis as to_karis
