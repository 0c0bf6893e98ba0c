"""Differentiable reference for light scattering from hair fibers.

Definitions, and how they differ from the papers: theta is the inclination from the
normal plane, phi = phi_o - phi_i, both directions point away from the fiber,
theta_d = (theta_o - theta_i)/2. M carries no 1/cos(theta_o); `evaluate` returns
S cos(theta_o), whose integral over outgoing solid angle is the albedo. Lobe widths are
standard deviations in radians, lengths are in fiber radii.
"""

from fiberjax import absorption as absorption
from fiberjax import artist as artist
from fiberjax import convert as convert
from fiberjax import deon2014 as deon2014
from fiberjax import directions as directions
from fiberjax import kajiya_kay as kajiya_kay
from fiberjax import karis as karis
from fiberjax import lambert as lambert
from fiberjax import marschner as marschner
from fiberjax import nearfield as nearfield
from fiberjax import perceptual as perceptual
from fiberjax import pigment as pigment
from fiberjax import realtime as realtime
from fiberjax import scene as scene
from fiberjax import shader as shader
from fiberjax.auto import auto as auto
from fiberjax.azimuthal import N as N
from fiberjax.baking import tabulate as tabulate
from fiberjax.bulk import in_blocks as in_blocks
from fiberjax.circular import trimmed_logistic as trimmed_logistic
from fiberjax.circular import wrapped_normal as wrapped_normal
from fiberjax.energy import albedo as albedo
from fiberjax.farfield import evaluate as evaluate
from fiberjax.farfield import lobe as lobe
from fiberjax.farfield import pdf as pdf
from fiberjax.fiber import Fiber as Fiber
from fiberjax.fiber import check as check
from fiberjax.frame import from_angles as from_angles
from fiberjax.frame import to_angles as to_angles
from fiberjax.fresnel import reflectance as reflectance
from fiberjax.graded import GaussGamma as GaussGamma
from fiberjax.path import A as A
from fiberjax.path import A_rest as A_rest
from fiberjax.path import Phi as Phi
from fiberjax.path import eta_prime as eta_prime
from fiberjax.path import transmittance as transmittance
from fiberjax.roots import Caustics as Caustics
from fiberjax.roots import Roots as Roots
from fiberjax.roots import caustics as caustics
from fiberjax.roots import roots as roots
from fiberjax.sampling import Sample as Sample
from fiberjax.sampling import sample as sample
from fiberjax.series import Series as Series
from fiberjax.smooth import N_smooth as N_smooth
from fiberjax.smooth import pdf_smooth as pdf_smooth
from fiberjax.spherical import M as M
from fiberjax.spherical import sample_M as sample_M
from fiberjax.table import Table as Table
from fiberjax.textbook import GaussH as GaussH
from fiberjax.windows import Windowed as Windowed
