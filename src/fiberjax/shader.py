"""Real-time approximations as shader source in HLSL, GLSL and WGSL.

The source is emitted from the JAX functions themselves: nothing is written twice.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import artist, heads, karis, realtime, tail
from fiberjax._types import Floats, choice
from fiberjax.emission import DOTS, Program, emitted
from fiberjax.expression import DIRECTIONS, MATERIAL, Graph, Node
from fiberjax.fiber import Fiber, cast
from fiberjax.languages import LANGUAGES
from fiberjax.regrouping import regrouped
from fiberjax.shading import added, of_dots, of_fiber
from fiberjax.tracing import section, traced

_LOBES = ("R", "TT", "TRT")


class Material(NamedTuple):
    """The fields of a `fiberjax.Fiber` that shaders know; the others are default."""

    eta: Any
    sigma_a: Any
    beta_m: Any
    beta_n: Any
    alpha: Any


class ArtistMaterial(NamedTuple):
    """Karis' parameters, see `fiberjax.artist.Artist`, and the shadow."""

    base_color: Any
    specular: Any
    roughness: Any
    scatter: Any
    shift: Any
    shadow: Any


_COLORS = ("sigma_a", "base_color")


class Shader(NamedTuple):
    """What a shader computes, and what to say about it.

    Fields:
        material: the class of its material, a NamedTuple.
        bsdf: result of a material and `fiberjax.shading.Directions`, on a last axis.
        about: lines for the head of the file: what it is, form, domain, source.
        sections: what each function computes, by the name of its section.
    """

    material: type
    bsdf: Callable[..., Floats]
    about: tuple[str, ...]
    sections: dict[str, str]


def _of_tier(tier: str, rest: bool = False) -> Callable[..., Floats]:
    """R + TT + TRT of a tier, and the rest, each a section."""
    lobe, constants = realtime.tier_of(tier)
    # Python's numbers take any dtype, arrays have one.
    constants = jax.tree.map(
        lambda x: x if isinstance(x, float) else np.asarray(x, np.float32), constants
    )

    def bsdf(material, at):
        hair = of_fiber(cast(Fiber(**material._asdict()), at.sin_i.dtype))
        terms = [
            section(name, partial(lobe, p, constants))(hair, at)
            for p, name in enumerate(_LOBES)
        ]
        if rest:
            terms.append(section("rest", partial(tail.rest, tail.FITTED))(hair, at))
        return added(terms)

    return bsdf


def _drop_in(material, at):
    """The whole model of Karis."""
    *fields, shadow = material
    terms = [
        section(name, partial(part, k=karis.PUBLISHED))(
            artist.Artist(*fields), at, shadow
        )
        for name, part in artist.PARTS.items()
    ]
    return added(terms)


SHADERS = {
    "karis2016": Shader(
        Material,
        _of_tier("karis2016"),
        (
            "Hair of Karis 2016, as published: R + TT + TRT of a fiber.",
            "Form: a Gaussian in sin theta times one exponential in cos phi per lobe.",
            "It knows eta only in F and beta_n nowhere: eta' is fitted for eta = 1.55.",
            "Domain: none is given; C in (0, 1], roughness to 1; shift is .035 there.",
            "Constants: those published. Source: Karis 2016, Physically based hair",
            "shading in Unreal.",
        ),
        heads.KARIS,
    ),
    "karis2016_artist": Shader(
        ArtistMaterial,
        _drop_in,
        (
            "Hair of Karis 2016, as published: R + TT + TRT and scattering, by what an",
            "artist sets. eta = 1.55.",
            "Form: a Gaussian in sin theta times one exponential in cos phi per lobe.",
            "Domain: none is given; C in (0, 1], roughness to 1; shift is .035 there.",
            "Constants: those published. Source: Karis 2016, Physically based hair",
            "shading in Unreal.",
        ),
        heads.KARIS,
    ),
    **{
        name: Shader(
            Material,
            _of_tier(name),
            (heads.TITLES[name], *heads.FITTED),
            heads.EXPONENTIAL,
        )
        for name in realtime.FITTED
    },
}
"""What can be emitted: the tiers of `realtime.TIERS`, with the rest and without it, and
Karis' own parameters."""


def _with_rest(tier: str) -> Shader:
    """The shader of a tier and the rest."""
    shader = SHADERS[tier]
    return shader._replace(
        bsdf=_of_tier(tier, True),
        about=(*shader.about, *heads.WITH_REST),
        sections=shader.sections | {"rest": heads.REST},
    )


SHADERS |= {f"{tier}_rest": _with_rest(tier) for tier in realtime.TIERS}


def _inputs(graph: Graph, shader: Shader) -> tuple[list[Node], list[Node]]:
    fields = shader.material.__annotations__
    material = [graph.input(name, MATERIAL, name in _COLORS) for name in fields]
    return material, [graph.input(name, DIRECTIONS) for name in DOTS]


def program(tier: str, measured: Sequence[str] = ()) -> Program:
    """What a tier's shader is made from, in no language yet.

    Args:
        tier: one of `SHADERS`.
        measured: lines for the head of the file, as of its errors.

    Returns:
        The program, for `fiberjax.emission.emitted`.

    Raises:
        ValueError: an unknown tier.
        EmissionError: the tier's function has what no shader has; it is named.
    """
    choice("tier", tier, tuple(SHADERS))
    shader, graph = SHADERS[tier], Graph()
    material, dots = _inputs(graph, shader)
    like = [jax.ShapeDtypeStruct((3,) * x.color, jnp.float32) for x in material]
    number = jax.ShapeDtypeStruct((), jnp.float32)
    root = traced(
        graph,
        lambda material, *dots: shader.bsdf(material, of_dots(*dots)),
        (shader.material(*like), number, number, number),
        [*material, *dots],
        tuple(shader.sections),
    )
    return Program(
        regrouped(root),
        {node: heads.MEANING[node.name] for node in material},
        shader.sections,
        [
            *shader.about,
            "",
            *heads.DIRECTIONS,
            *measured,
            "",
            "Emitted by fits/shaders.py.",
        ],
    )


def source(tier: str, language: str, measured: Sequence[str] = ()) -> str:
    """A tier as one file of a shading language, without an entry point.

    It defines `hair_bsdf(material, L, V, T)`, and `hair_constants(material)` with
    `hair_bsdf_hoisted(constants, L, V, T)`, which computes again nothing that depends
    on the material alone. L is direction i of `realtime.evaluate`, V direction o.

    Every square root and power is of what is >= 0 by its form. Products, sums and
    exponents are regrouped as those of real numbers.

    Args:
        tier: one of `SHADERS`: the tiers of `realtime.TIERS`; those with "_rest" behind
            the name, which add `realtime.rest`; and "karis2016_artist", which has
            Karis' own parameters and scattering.
        language: "hlsl", "glsl" or "wgsl".
        measured: lines for the head of the file, as of its errors.

    Returns:
        The text.

    Raises:
        ValueError: an unknown tier or language.
        EmissionError: the tier's function has what no shader has; it is named.
    """
    choice("language", language, tuple(LANGUAGES))
    return emitted(program(tier, measured), LANGUAGES[language])
