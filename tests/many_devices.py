"""What a mesh of all devices computes, as .npz: a script for one or more processes."""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import fiberjax as fj

CHOICES = {"lobes": (1,), "rest": False}
RULE = fj.GaussGamma(16)
BLOCK = 256
DRAWN = 2048
THETA_I = 0.6


def hair():
    """The fiber; arrays cannot be made before devices are."""
    return fj.Fiber(sigma_a=(0.1, 0.4, 1.2))


def angles(n):
    """theta_i, theta_o, phi of n directions."""
    return np.random.default_rng(0).uniform([-1, -1, -3], [1, 1, 3], (n, 3)).T


def scene():
    """The fiber's; its plan has tables, made within every block."""
    return fj.scene.Scene.of(hair(), tolerance=1e-2)


FULL = partial(fj.evaluate, rule=RULE, **CHOICES)


def evaluate(f, mesh, n):
    """Values of n directions."""
    return fj.in_blocks(f, mesh=mesh, block=BLOCK)(hair(), *angles(n))


def gradient(f, mesh, n):
    """That of the mean square of them in the numbers of the fiber."""
    bulk = fj.in_blocks(f, mesh=mesh, block=BLOCK)
    loss = jax.jit(jax.grad(lambda fiber, *at: (bulk(fiber, *at) ** 2).mean()))
    return loss(hair(), *angles(n))


def furnace(mesh, seeds):
    """The mean weight of the samples of each seed, drawn where they are used."""

    def mean(fiber, seed):
        u = jax.random.uniform(jax.random.key(seed[0]), (DRAWN, 5))
        draw = fj.sample(fiber, THETA_I, u, strategy="lobe_first", **CHOICES)
        return draw.weight.mean(0)[None]

    return fj.in_blocks(mean, mesh=mesh, block=1)(hair(), np.arange(seeds))


def bake(mesh, folder):
    """A table of the evaluated directions of one theta_i."""
    f = partial(FULL, hair(), THETA_I)
    axes = {"theta_o": (-1.5, 1.5), "phi": (0.0, np.pi)}
    keep = {"folder": folder, "chunk": 512, "entries": 4096}
    return fj.tabulate(f, axes, tolerance=0.02, mesh=mesh, **keep)


def bake_in_float32(mesh, folder):
    """The table of a function whose values are not of the dtype of its arguments."""

    def f(x):
        return jnp.float32(jnp.cos(3 * x))

    keep = {"folder": folder, "chunk": 64, "entries": 256}
    return fj.tabulate(f, {"x": (0.0, 1.0)}, tolerance=0.01, mesh=mesh, **keep)


def main():
    """Compute all and write what the first process sees."""
    parser = argparse.ArgumentParser()
    parser.add_argument("output", type=Path)
    parser.add_argument("plan", type=Path, help="of the scene, as Plan.save writes it")
    parser.add_argument("--devices", type=int, default=1)
    parser.add_argument("--process", type=int, nargs=3, help="port, count, number")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_num_cpu_devices", options.devices)
    if options.process:
        port, count, number = options.process
        jax.distributed.initialize(f"localhost:{port}", count, number)
    mesh = jax.make_mesh((jax.device_count(),), ("queries",))
    planned = fj.scene.Plan.load(options.plan).evaluate
    found = {
        "values": evaluate(FULL, mesh, 4096),
        "uneven": evaluate(FULL, mesh, 1001),
        "planned": evaluate(planned, mesh, 4096),
        "furnace": furnace(mesh, 16),
    }
    for name, f in (("gradient", FULL), ("planned gradient", planned)):
        leaves = jax.tree.leaves(gradient(f, mesh, 4096))
        found |= {f"{name} {k}": leaf for k, leaf in enumerate(leaves)}
    spread = jax.sharding.PartitionSpec()
    whole = jax.jit(lambda x: x, out_shardings=jax.sharding.NamedSharding(mesh, spread))
    arrays: Any = {name: np.asarray(whole(x)) for name, x in found.items()}
    arrays["devices"] = mesh.size
    for name, of in (("table", bake), ("float32 table", bake_in_float32)):
        folder = options.output.with_name(f"{options.output.stem} {name}")
        table = of(mesh, folder)
        arrays |= {name: table.values, f"{name} again": of(mesh, folder).values}
        arrays |= {f"axis {k} of {name}": axis for k, axis in enumerate(table.axes)}
    if jax.process_index() == 0:
        np.savez(options.output, **arrays)


if __name__ == "__main__":
    main()
