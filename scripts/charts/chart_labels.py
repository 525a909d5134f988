"""What charts call the matrix-valued models and the comparators, and names beside points."""
import matplotlib

NAMES = {
    "elastic_exact": "elastic, columns kept",
    "fem_exact": "fem, columns kept",
    "compact_elastic": "compact elastic",
    "thin_plate": "thin-plate",
    "thin_plate_walls": "thin-plate, walls held",
    "multiquadric": "multiquadric",
    "multiquadric_walls": "multiquadric, walls held",
    "mass_spring_8mm": "mass-spring 8 mm",
    "mass_spring_4mm": "mass-spring 4 mm",
    "chainmail_4mm": "ChainMail 4 mm",
    "paper_csrbf_psi31_a12": "the paper's ψ3,1, a = 12",
}


def label(figure, axes, points, obstacles):
    """Names beside their points, each at the first place where it covers nothing (points: x, y, text, weight)."""
    renderer = figure.canvas.get_renderer()
    taken = []
    dots = [axes.transData.transform(p) for p in obstacles]
    inside = axes.get_window_extent(renderer)
    places = [
        (5, 4, "left"),
        (5, -11, "left"),
        (-5, 4, "right"),
        (-5, -11, "right"),
        (0, 8, "center"),
        (0, -15, "center"),
    ]
    places += [
        (dx, dy, side)
        for dy in (16, -22, 28, -34, 40, -46, 52, -58)
        for dx, side in ((5, "left"), (-5, "right"), (0, "center"))
    ]
    for x, y, text, weight in points:
        for dx, dy, side in places:
            far = abs(dy) > 15
            note = axes.annotate(
                text,
                (x, y),
                xytext=(dx, dy),
                textcoords="offset points",
                ha=side,
                fontsize=8,
                fontweight=weight,
                arrowprops={"arrowstyle": "-", "lw": 0.5, "color": "gray"} if far else None,
            )
            note.update_positions(renderer)
            box = matplotlib.text.Text.get_window_extent(note, renderer).padded(1)
            free = not any(box.overlaps(other) for other in taken) and not any(box.contains(*dot) for dot in dots)
            if free and inside.x0 <= box.x0 and box.x1 <= inside.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1:
                break
            note.remove()
        else:
            note = axes.annotate(text, (x, y), xytext=(5, 4), textcoords="offset points", fontsize=8)
            box = matplotlib.text.Text.get_window_extent(note, renderer)
        taken.append(box)
