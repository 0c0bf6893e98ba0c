"""Which rule to use when, with its error and time, as the README has it."""

from collections.abc import Iterable, Mapping

LINES = (
    ("any roughness, all digits", "N", "auto", "1e-12", "float64"),
    ("any roughness, film", "N", "auto", "1e-06", "float64"),
    ("any roughness, games", "N", "auto", "0.01", "float32"),
    ("many phi to a theta_d, here 2048", "N_grid", "auto", "1e-06", "float64"),
    ("beta_n > 0.2 known", "N", "GaussGamma", "16", "float64"),
    ("beta_n < 0.1 known", "N", "Windowed", "32", "float64"),
    ("to compare with papers", "N", "GaussH", "70", "float64"),
)
"""The need; quantity, form, first number of its setting and dtype in the table."""


def advice(rows: Iterable[Mapping[str, str]], lobe: str = "TRT") -> str:
    """A Markdown table: error over the peak, and microseconds a value."""
    found = {}
    for row in rows:
        if row["case"] == lobe:
            first = row["quantity"], row["form"], row["setting"].split(" ")[0]
            found[(*first, row["dtype"], float(row["width"]))] = row
    widths = sorted({key[-1] for key in found})
    head = " | ".join(f"beta_n {width:g}" for width in widths)
    text = [f"| need | rule | {head} |", "|---" * (2 + len(widths)) + "|"]
    for need, quantity, form, number, dtype in LINES:
        some = [found[quantity, form, number, dtype, width] for width in widths]
        cells = [
            f"{float(x['error']):.0e}, {float(x['ns_per_value']) / 1e3:.2g} µs"
            for x in some
        ]
        name = f"`{form}({some[0]['setting'].replace(' ', ', ')})`"
        name += " in float32" if dtype == "float32" else ""
        text.append(f"| {need} | {name} | {' | '.join(cells)} |")
    return "\n".join(text)
