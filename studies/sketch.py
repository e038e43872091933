"""A line drawing of the rig, with the places of the causes marked on it, as inline SVG."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

INK, MARK, FAINT = "#3a3f45", "#d55e00", "#9aa2ab"
_WIDTH, _HEIGHT, _MIDDLE = 600, 172, 92.0

# Where the places of the robot lie on the drawing, and what is written beside them.
_ROBOT: dict[str, tuple[float, float]] = {
    "base": (34, 60),
    "drive": (34, 60),
    "arm": (105, 74),
    "hand": (176, 88),
    "wrist": (176, 88),
    "collet": (228, 88),
    "sleeve": (256, 88),
    "grip": (300, 88),
    "shaft": (430, 82),
    "clubhead": (560, 98),
}
_ROBOT_NAMES: dict[str, tuple[float, float]] = {
    "arm": (105, 62),
    "wrist": (176, 124),
    "sleeve": (256, 132),
    "grip": (316, 118),
    "shaft": (430, 112),
    "clubhead": (556, 132),
}


def sketch(rig: Mapping[str, Any], places: Iterable[str]) -> str:
    """Draw a rig with places marked.

    Args:
        rig: ``kind`` (robot or chain), ``motion``, ``masses`` (names), ``links`` (name to the two
            ends) and ``channels`` (name to the place where it is measured). What is missing is
            left out.
        places: names of the places to mark; one that is not on the drawing is written below it.

    Returns:
        One ``<svg>`` element; every name in it is escaped.
    """
    marked = list(dict.fromkeys(places))
    if rig.get("kind") == "chain" and (rig.get("masses") or rig.get("links")):
        body, where, names = _chain(rig)
    else:
        body, where, names = _robot(), dict(_ROBOT), _ROBOT_NAMES
    for channel, place in dict(rig.get("channels") or {}).items():
        if place in where:
            where.setdefault(channel, where[place])
    rings = [_ring(where[place], place) for place in marked if place in where]
    labels = [
        _text(x, y, name, FAINT, "middle") for name, (x, y) in names.items() if name not in marked
    ]
    lost = [place for place in marked if place not in where]
    if lost:
        words = "not on this drawing: " + ", ".join(lost)
        rings.append(_text(_WIDTH - 4, 14, words, MARK, "end", bold=True))
    label = "Sketch of the rig" + (f", marked at {', '.join(marked)}" if marked else "")
    return (
        f'<svg class="sketch" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        f'aria-label="{escape(label)}" font-family="inherit" font-size="13">'
        + "".join(body + labels + rings)
        + "</svg>"
    )


def _text(x: float, y: float, words: str, color: str, anchor: str, bold: bool = False) -> str:
    weight = ' font-weight="700"' if bold else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" text-anchor="{anchor}"{weight}>'
        f"{escape(words)}</text>"
    )


def _line(points: Sequence[tuple[float, float]], width: float = 2, color: str = INK) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return (
        f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}" '
        'stroke-linejoin="round" stroke-linecap="round"/>'
    )


def _ring(point: tuple[float, float], place: str) -> str:
    x, y = point
    anchor = "start" if x < 60 else "end" if x > _WIDTH - 60 else "middle"
    up = y <= _MIDDLE
    ring, leader, label = (y - 17, 36, 27) if up else (y + 17, 156, 167)
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="17" fill="{MARK}" fill-opacity="0.14" '
        f'stroke="{MARK}" stroke-width="3"/>'
        + _line([(x, ring), (x, leader)], 1.5, MARK)
        + _text(x, label, place, MARK, anchor, bold=True)
    )


def _spring(start: tuple[float, float], end: tuple[float, float]) -> str:
    """A zigzag from one point to another on the same height."""
    (x, y), (far, _) = start, end
    lead = 0.18 * (far - x)
    teeth = [(x, y), (x + lead, y)]
    n = 8
    for i in range(n):
        teeth.append((x + lead + (far - x - 2 * lead) * (i + 0.5) / n, y + (7 if i % 2 else -7)))
    return _line([*teeth, (far - lead, y), (far, y)])


def _wall(x: float, top: float, bottom: float, side: float) -> str:
    parts = [_line([(x, top), (x, bottom)], 3)]
    rows = max(2, int((bottom - top) // 12))
    for i in range(rows + 1):
        y = top + (bottom - top) * i / rows
        parts.append(_line([(x, y), (x + 9 * side, y + 8)], 1.2, FAINT))
    return "".join(parts)


def _robot() -> list[str]:
    """Arm, wrist, collet with the sleeve's springs around the grip, shaft, clubhead."""
    teeth = []
    for x in (240, 272):
        for y, far in ((72, 82), (104, 94)):
            teeth.append(
                _line([(x, y), (x - 4, y + (far - y) * 0.3), (x + 4, y + (far - y) * 0.7)])
            )
            teeth.append(_line([(x + 4, y + (far - y) * 0.7), (x, far)]))
    return [
        _wall(16, 38, 84, -1),
        '<circle cx="34" cy="60" r="9" fill="#fff" stroke="#3a3f45" stroke-width="2"/>',
        _line([(43, 61), (168, 87)], 7, "#c3c9cf"),
        _line([(43, 61), (168, 87)], 1.5),
        '<rect x="184" y="68" width="110" height="40" rx="4" fill="#eef1f4" stroke="#3a3f45" '
        'stroke-width="1.5"/>',
        '<rect x="214" y="82" width="112" height="12" rx="4" fill="#7d8791"/>',
        *teeth,
        '<path d="M326 88 C 420 78, 490 82, 552 92" fill="none" stroke="#3a3f45" '
        'stroke-width="3"/>',
        '<path d="M550 84 l24 6 q10 12 -4 20 l-22 -4 z" fill="#3a3f45"/>',
        '<circle cx="176" cy="88" r="8" fill="#fff" stroke="#3a3f45" stroke-width="2.5"/>',
    ]


def _chain(
    rig: Mapping[str, Any],
) -> tuple[list[str], dict[str, tuple[float, float]], dict[str, tuple[float, float]]]:
    """Parts of the drawing, the points of the places, and the points of the links' names."""
    masses = list(rig.get("masses") or [])
    nodes = ["ground", *masses]
    gap = (_WIDTH - 40) / len(masses) if masses else _WIDTH - 40
    box = min(84.0, 0.42 * gap)
    centers = {name: 30 + gap * (i + 1) - box / 2 for i, name in enumerate(masses)}
    centers["ground"] = 26.0
    parts = [_wall(26, 56, 130, -1)]
    where = {name: (x, _MIDDLE) for name, x in centers.items()}
    where["base"] = where["ground"]
    names: dict[str, tuple[float, float]] = {}
    for (near, far), stack in _stacks(rig, nodes).items():
        neighbors = nodes.index(far) - nodes.index(near) == 1
        for i, name in enumerate(stack):
            if neighbors:
                y = _MIDDLE + 44 * (i - (len(stack) - 1) / 2)
                start = centers[near] + (0 if near == "ground" else box / 2)
                end = centers[far] - box / 2
            else:  # bridged below the row
                y, start, end = _MIDDLE + 52, centers[near], centers[far]
                parts += [_line([(x, _MIDDLE + 20), (x, y)]) for x in (start, end)]
            parts.append(_spring((start, y), (end, y)))
            where[name] = ((start + end) / 2, y)
            names[name] = ((start + end) / 2, y + 22)
    for name in masses:
        parts.append(_mass(name, centers[name], box, rig.get("motion") == "rotation"))
    return parts, where, names


def _stacks(rig: Mapping[str, Any], nodes: list[str]) -> dict[tuple[str, str], list[str]]:
    """Names of the links between each pair of nodes, the nearer to the ground first."""
    stacks: dict[tuple[str, str], list[str]] = {}
    for name, ends in dict(rig.get("links") or {}).items():
        near, far = sorted(ends, key=lambda end: nodes.index(end) if end in nodes else -1)
        if near in nodes and near != far:
            stacks.setdefault((near, far), []).append(name)
    return stacks


def _mass(name: str, x: float, box: float, turns: bool) -> str:
    left = x - box / 2
    if turns:
        shape = f'<circle cx="{x:.1f}" cy="{_MIDDLE}" r="{box / 2:.1f}"'
    else:
        shape = f'<rect x="{left:.1f}" y="{_MIDDLE - 30}" width="{box:.1f}" height="60" rx="4"'
    fill = ' fill="#eef1f4" stroke="#3a3f45" stroke-width="2"/>'
    return shape + fill + _text(x, _MIDDLE + 5, name, INK, "middle")
