"""The forms of the tiers: the monomials of each coefficient, and where fits start.

A coefficient is a string of monomials in what `fiberjax.exponential.features` names,
"1" for none. It starts at 0, or where `START` says.
"""

from typing import Any

import jax
import numpy as np

_R_LIGHT = {
    "kT": "1 b",
    "kP": "1",
    "kF": "1 b",
    "over_v": "1",
    "beta_n": "1",
    "lines": [
        {"slope": "1 m", "offset": "1"},
        {"slope": "1 m mm", "offset": "1 m"},
    ],
    "exponent": {"1": "1 bb m mm", "P": "1 b e", "PP": "1 b e"},
}
_R_MEDIUM = {
    **dict.fromkeys(("kT", "kP", "kF", "over_v", "beta_n"), "1"),
    "lines": [
        {"slope": "1", "offset": "1"},
        {"slope": "1", "offset": "1"},
        {"slope": "1", "offset": "b"},
    ],
    "exponent": {"1": "1", "x": "1 b e", "P": "1 b e", "q": "b m"},
}
_R_FINE = {
    **dict.fromkeys(("kP", "kF", "over_v", "beta_n"), "1"),
    "kT": "1 b",
    "lines": [
        {"slope": "1", "offset": "1"},
        {"slope": "1", "offset": "1"},
        {"slope": "1 mm", "offset": "m"},
    ],
    "exponent": {
        "1": "1 b be",
        "x": "1 b e",
        "P": "1 b e",
        "PP": "1 e",
        "q": "b be",
        "u": "b",
    },
}
_TT_RISE = {"Y": "1 b e m", "a": "1 b m"}
_TT_MEDIUM = {
    "rise": _TT_RISE,
    "terms": [
        {
            "over_v": "1 m mm",
            "K": "1 b bb e be ee s bs",
            "exponent": {
                "u": "1 b bb e be ee s bs es",
                "q": "1 b bb e be s bs es",
                "uq": "1 b e be s bs es",
                "uu": "1 b e",
                "uuu": "1 b",
                "uuq": "1 b bb",
                "uuuq": "1 b",
                "qq": "1 b e m",
                "qqq": "1 m",
            },
        }
    ],
}
_TT_LIGHT = {
    "rise": _TT_RISE,
    "terms": [
        {
            **_TT_MEDIUM["terms"][0],
            "exponent": {
                "u": "1 b bb e be ee",
                "q": "1 b bb e be s bs es",
                "uq": "1 b e be",
                "uu": "1 b e",
                "uuu": "1 b",
                "uuq": "1 b bb",
                "qq": "1 b e m",
            },
        }
    ],
}
_TT_FINE = {
    "rise": _TT_RISE,
    "terms": [
        {
            "over_v": "1 m mm",
            "K": "1 b bb e be ee s bbs",
            "exponent": {
                "u": "1 b bb e be ee bs",
                "q": "1 b bb e be ee s bs es",
                "uq": "1 b bb e be s bs es",
                "uu": "1 b bb e s bs es",
                "uuu": "1 b bb",
                "uuq": "1 b bb ee",
                "uuuq": "1 b bb",
                "qq": "1 b e s m",
                "qqq": "1 m",
                "uqq": "1 b",
            },
        }
    ],
}
_TRT_RISE = {"Y": "1 b m", "a": "1 b m"}
_BROAD = {
    "over_v": "1 m",
    "K": "1 r rr b e m s",
    "exponent": {
        "u": "1 r rr b e",
        "uq": "1 r b",
        "q": "1 r b e m",
        "uu": "1 r b",
        "qq": "1 r",
    },
}
_SHARP = {
    "over_v": "1 m",
    "K": "1 r s rs",
    "exponent": {
        "u": "1 r rr e er",
        "uq": "1 r rr",
        "uu": "1 r rr e",
        "q": "1 r e er",
        "qq": "1 r",
    },
}
_ONE = {
    "over_v": "1 m",
    "K": "1 r b e m s",
    "exponent": {"u": "1 r rr", "uq": "1 r rr", "q": "1 r e m"},
}

FORMS: dict[str, Any] = {
    "light": {
        "R": _R_LIGHT,
        "TT": _TT_LIGHT,
        "TRT": {"rise": _TRT_RISE, "terms": [_ONE]},
    },
    "medium": {
        "R": _R_MEDIUM,
        "TT": _TT_MEDIUM,
        "TRT": {"rise": _TRT_RISE, "terms": [_BROAD, _SHARP]},
    },
    "fine": {
        "R": _R_FINE,
        "TT": _TT_FINE,
        "TRT": {"rise": _TRT_RISE, "terms": [_BROAD, _SHARP]},
    },
}

START: dict[str, Any] = {
    "R": {
        "kT": {"1": 0.6},
        "kP": {"1": 1.0},
        "kF": {"1": 0.7},
        "lines": [
            {"slope": {"1": 3.0}, "offset": {"1": 1.0}},
            {"slope": {"1": 7.0}, "offset": {"1": -2.0}},
            {"slope": {"1": 5.0}},
        ],
        "exponent": {"1": {"1": -2.0}, "x": {"1": -1.4}},
    },
    "TT": {
        "rise": {"Y": {"1": 0.45}, "a": {"1": 0.2}},
        "terms": [{"K": {"1": -3.0, "s": -2.0}, "exponent": {"u": {"1": -4.0}}}],
    },
    "TRT": {
        "rise": {"Y": {"1": 0.28, "m": -0.1}, "a": {"1": 0.06, "m": 0.38}},
        "terms": [
            {
                "K": {"1": -2.6, "b": -0.7, "m": 0.73, "rr": -0.45, "s": -4.9},
                "exponent": {
                    "u": {"1": 5.1, "b": -2.6, "r": 2.6, "rr": 0.8},
                    "uq": {"1": 5.2, "b": -3.4, "r": 4.2},
                    "q": {"1": -0.14, "b": -1.1, "m": 0.87, "r": -1.2},
                    "uu": {"1": -1.3, "b": 0.77},
                    "qq": {"1": -0.55, "r": -0.52},
                },
                "over_v": {"m": 0.44},
            },
            {
                "K": {"1": -4.6, "r": 2.4, "s": -3.3},
                "exponent": {
                    "u": {"1": -0.4, "e": -4.9, "er": 29.0, "r": 12.0, "rr": 73.0},
                    "uq": {"1": 2.6, "r": 3.3, "rr": -116.0},
                    "uu": {"1": -16.0, "e": -0.56, "r": 186.0, "rr": -549.0},
                    "q": {"1": 1.9, "er": 0.9},
                    "qq": {"1": -0.66, "r": -1.5},
                },
                "over_v": {"m": -0.41},
            },
        ],
    },
}
"""What is not 0; of TRT, two digits of the best of many starts."""


def constants(form: Any, start: Any, noise: Any = lambda: 0.0) -> Any:
    """The numbers of a form at their start, those of no feature with noise."""
    if isinstance(form, str):
        given = start or {}
        return {
            key: given.get(key, 0.0) + (noise() if key == "1" else 0.0)
            for key in form.split()
        }
    if isinstance(form, list):
        starts = [*(start or []), *len(form) * [None]]
        return [constants(*pair, noise) for pair in zip(form, starts, strict=False)]
    return {key: constants(x, (start or {}).get(key), noise) for key, x in form.items()}


def moved(k: Any, seed: int, spread: float) -> Any:
    """Constants times normal numbers about 1; as they are for the first seed."""
    one = noise(seed, spread)
    return jax.tree.map(lambda x: x * (1 + one()), k)


def noise(seed: int, deviation: float) -> Any:
    """Normal numbers; 0 for the first seed."""
    rng = np.random.default_rng(seed)
    return lambda: float(deviation * rng.standard_normal()) if seed else 0.0
