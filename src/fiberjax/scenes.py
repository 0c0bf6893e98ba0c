"""What a scene asks for: ranges of fibers and directions, and a tolerance."""

from dataclasses import asdict, dataclass, fields
from typing import Any

import jax
import numpy as np

from fiberjax._types import choice
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import DOMAINS, MAY_MISS, MAY_TOUCH, PER_LOBE, Fiber
from fiberjax.model import INCIDENCES
from fiberjax.ranges import Interval, Range, covers, interval
from fiberjax.selection import DEFAULT_STRATEGY, STRATEGIES

ANGLES = {
    "theta_i": (-np.pi / 2, np.pi / 2),
    "theta_o": (-np.pi / 2, np.pi / 2),
    "phi": (-np.inf, np.inf),
}
NUMBERS = ("eta", "beta_m", "beta_n", "alpha", "sigma_a")
DTYPES = ("float32", "float64")


def _name(dtype: Any) -> Any:
    """The name of a dtype; what is none stays, and NumPy takes None for one."""
    try:
        return None if dtype is None else np.dtype(dtype).name
    except TypeError:
        return dtype


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The fibers and directions that will be asked for, and how well.

    Each of the first eight fields is a number, an interval (low, high), ends included,
    or for alpha and sigma_a None where there is no tilt and no absorption. A number is
    an interval of no width: the fiber that is evaluated brings its own, and derivatives
    in it are those of the full model.

    Fields:
        eta, beta_m, beta_n, alpha, sigma_a: of the fibers, as in `Fiber`; sigma_a of
            every color. alpha = None and sigma_a = None mean fibers that have None.
        theta_i, theta_o, phi: radians. All directions where not given.
        tolerance: largest error of S cos(theta_o) over its peak, and of the albedo over
            the albedo, in (0, 1). The peak is that of the fiber, color and theta_i at
            hand, over all theta_o and phi.
        dtype: "float32" or "float64", of the angles.
        widths_m, widths_n, tilts: factors for lobes 0, 1, ..., as in `Fiber`.
        detector, incidence: of the model, as in `evaluate`.
        strategy: of `pdf` and `sample`.

    Raises:
        ValueError: naming the argument, the value and what is allowed.
    """

    eta: Range
    beta_m: Range
    beta_n: Range
    alpha: Range | None = None
    sigma_a: Range | None = None
    theta_i: Range = ANGLES["theta_i"]
    theta_o: Range = ANGLES["theta_o"]
    phi: Range = (-np.pi, np.pi)
    tolerance: float
    dtype: str = "float64"
    widths_m: tuple[float, ...] = (1.0, 0.5, 2.0)
    widths_n: tuple[float, ...] = (1.0,)
    tilts: tuple[float, ...] = (2.0, -1.0, -4.0, 0.0)
    detector: str = "normal"
    incidence: str = "theta_d"
    strategy: str = DEFAULT_STRATEGY

    def __post_init__(self):
        def put(name, value):
            object.__setattr__(self, name, value)

        for name in (*NUMBERS, *ANGLES):
            given = getattr(self, name)
            if given is None and name in MAY_MISS:
                continue
            allowed = ANGLES[name] if name in ANGLES else DOMAINS[name]
            touch = name in MAY_TOUCH or name in ANGLES
            put(name, interval(name, given, allowed, touch))
        tolerance = np.asarray(self.tolerance)
        if tolerance.dtype.kind != "f" or tolerance.ndim or not 0 < tolerance < 1:
            raise ValueError(f"tolerance = {self.tolerance!r}: must lie in (0, 1)")
        put("tolerance", float(tolerance))
        put("dtype", _name(self.dtype))
        choice("dtype", self.dtype, DTYPES)
        for name in PER_LOBE:
            factors = np.ravel(np.asarray(getattr(self, name)))
            least = DOMAINS[name][0]
            good = factors.dtype.kind in "fiu" and factors.size
            if not good or not ((least < factors) & (factors < np.inf)).all():
                raise ValueError(
                    f"{name} = {getattr(self, name)!r}: must be numbers above "
                    f"{least:g}, one at least"
                )
            put(name, tuple(factors.astype(float).tolist()))
        choice("detector", self.detector, tuple(DETECTORS))
        choice("incidence", self.incidence, INCIDENCES)
        choice("strategy", self.strategy, STRATEGIES)

    @classmethod
    def of(cls, fibers: Fiber, **rest: Any) -> "Scene":
        """The scene of some fibers: from the smallest to the largest of each number.

        Args:
            fibers: one fiber, or a batch as for jax.vmap, of concrete numbers.
            **rest: the other fields of a `Scene`.

        Raises:
            ValueError: the factors of the lobes differ from fiber to fiber, a number
                given twice, and as `Scene`.
        """
        twice = [name for name in (*NUMBERS, *PER_LOBE) if name in rest]
        if twice:
            raise ValueError(f"{twice[0]} = {rest[twice[0]]!r}: is that of the fibers")
        found: dict[str, Any] = {}
        for name in NUMBERS:
            value = getattr(fibers, name)
            if value is not None:
                value = np.asarray(value, float)
                if not value.size:
                    raise ValueError(
                        f"{name} of the fibers has shape {value.shape}: must have one "
                        "fiber at least"
                    )
                value = float(value.min()), float(value.max())
            found[name] = value
        for name in PER_LOBE:
            rows = np.asarray(getattr(fibers, name), float)
            rows = rows.reshape(-1, rows.shape[-1])
            if (rows != rows[0]).any():
                raise ValueError(
                    f"{name} differs among the fibers: must be one; plan them apart"
                )
            found[name] = tuple(rows[0])
        return cls(**found, **rest)

    def check(self, fibers: Fiber, **angles: Any) -> None:
        """ValueError if a fiber or an angle lies outside the scene.

        Args:
            fibers: one fiber or a batch, of concrete numbers.
            **angles: theta_i, theta_o or phi.
        """
        self.check_absent(fibers)
        given = {name: getattr(fibers, name) for name in NUMBERS} | angles
        for name, value in given.items():
            if value is None:
                continue
            if name not in (*NUMBERS, *ANGLES):
                raise ValueError(f"{name}: must be one of {tuple(ANGLES)}")
            ends = getattr(self, name)
            if not covers(ends, value):
                value = np.asarray(value, float)
                worst = value.flat[
                    np.argmax(np.maximum(ends[0] - value, value - ends[1]))
                ]
                raise ValueError(
                    f"{name} = {worst:g}: must lie in [{ends[0]:g}, {ends[1]:g}]"
                )
        for name in PER_LOBE:
            rows = np.asarray(getattr(fibers, name), float)
            expected = getattr(self, name)
            if rows.shape[-1] != len(expected) or not np.allclose(rows, expected, 1e-6):
                raise ValueError(f"{name} = {rows.tolist()}: must be {expected}")

    def check_absent(self, fibers: Fiber) -> None:
        """ValueError if a fiber has an effect that the scene has not, or lacks one."""
        for name in MAY_MISS:
            ends, value = getattr(self, name), getattr(fibers, name)
            if ends is None and value is not None:
                raise ValueError(f"{name} of the fiber: must be None, as in the scene")
            if ends is not None and value is None and not covers(ends, 0.0):
                raise ValueError(
                    f"{name} of the fiber is None: must lie in [{ends[0]:g}, "
                    f"{ends[1]:g}], as in the scene"
                )

    def as_dict(self) -> dict[str, Any]:
        """The fields, as JSON has them."""
        return asdict(self)

    @classmethod
    def from_dict(cls, found: dict[str, Any]) -> "Scene":
        """The scene of `as_dict`, also by way of JSON."""
        names = {field.name for field in fields(cls)}
        if set(found) != names:
            raise ValueError(
                f"scene has fields {sorted(found)}: must be {sorted(names)}"
            )
        return cls(**found)

    def ends(self, name: str) -> Interval:
        """The range of a number or an angle; 0 for what is absent."""
        ends: Interval | None = getattr(self, name)
        return (0.0, 0.0) if ends is None else ends

    def low(self, name: str) -> float:
        """The lowest value of a number."""
        return self.ends(name)[0]

    def high(self, name: str) -> float:
        """The highest value of a number."""
        return self.ends(name)[1]

    def roughness(self, kind: str, lobe: int | None) -> Interval:
        """The range of a lobe's beta_m or beta_n, `kind`; of the rest for None."""
        factors = getattr(self, f"widths_{kind}")
        last = len(factors) - 1
        factor = factors[last if lobe is None else min(lobe, last)]
        name = f"beta_{kind}"
        return factor * self.low(name), factor * self.high(name)


def fiber_of(scene: Scene, numbers: dict[str, Any], dtype: Any) -> Fiber:
    """A batch of fibers of a scene, from arrays (n,) of its numbers."""
    count = len(numbers["eta"])
    factors = {
        name: np.tile(np.asarray(getattr(scene, name)), (count, 1)) for name in PER_LOBE
    }
    fibers = Fiber(**numbers, **factors)
    return jax.tree.map(lambda x: x.astype(dtype), fibers)
