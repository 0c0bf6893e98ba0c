"""Axes and text at places in inches from the upper left corner of a figure."""

from shared.style import WIDTH


def place(fig, left, top, width, height):
    """Axes of this size."""
    tall = fig.get_figheight()
    return fig.add_axes(
        (left / WIDTH, 1 - (top + height) / tall, width / WIDTH, height / tall)
    )


def write(fig, left, top, text, **style):
    """Text that starts, or is aligned, there."""
    fig.text(left / WIDTH, 1 - top / fig.get_figheight(), text, **style)
