"""From measured points to the cost of an error, and tables of that."""

import math

TARGETS = (1e-2, 1e-3, 1e-4)
# Of the discs' energies, root mean square: at the second one hundred discs are right within 1 %
# (three standard deviations).
DISC_TARGETS = (1e-2, 3e-3)


def falling(points):
    """Points by rising cost, only those with less error than every cheaper one."""
    kept = []
    for point in sorted(points, key=lambda point: (point["cpu_s"], point["relmse"])):
        if point["relmse"] > 0 and (not kept or point["relmse"] < kept[-1]["relmse"]):
            kept.append(point)
    return kept


def cost_of(points, target):
    """CPU seconds to `target`, log-log between points, and a mark.

    "": between two points; "<": the cheapest point is below already; "~": beyond the last point,
    along the last slope, at least a factor 2 in error. None where the error no longer falls.
    """
    kept = falling(points)
    if not kept:
        return None, ""
    if kept[0]["relmse"] <= target:
        return kept[0]["cpu_s"], "<"
    for a, b in zip(kept, kept[1:]):
        if b["relmse"] <= target:
            return between(a, b, target), ""
    last = kept[-1]
    for before in reversed(kept[:-1]):
        if before["relmse"] > 2 * last["relmse"]:
            return between(before, last, target), "~"
    return None, ""


def between(a, b, target):
    x = math.log(target / a["relmse"]) / math.log(b["relmse"] / a["relmse"])
    return a["cpu_s"] * (b["cpu_s"] / a["cpu_s"]) ** x


def ladder(points, program):
    """The points of `program` that make its curve: fixed counts, or fstop's targets."""
    return [p for p in points if p["program"] == program and "adaptive" not in p["setting"]]


def one_sample_cost(points, program):
    costs = [p["cpu_s"] for p in ladder(points, program) if p["setting"].get("samples") == 1]
    return costs[0] if costs else 0.0


def by_discs(points):
    """The same points, whose error is that of the discs' energies; squared, as relMSE is."""
    return [
        {**point, "relmse": point["disc_rms"] ** 2 - point["disc_rms_of_reference"] ** 2}
        for point in points
        if "disc_rms" in point
    ]


def costs(points, program, targets=TARGETS):
    """For every target: gross and net CPU seconds and the mark."""
    start = one_sample_cost(points, program)
    curve = ladder(points, program)
    if program == "fstop":  # as users ask for it; the forced single sample is only the start
        curve = [point for point in curve if "max_error" in point["setting"]]
    result = []
    for target in targets:
        gross, mark = cost_of(curve, target)
        net = None if gross is None else max(gross - start, 0.0)
        result.append({"target": target, "gross": gross, "net": net, "mark": mark})
    return result


def ratios(points, program, targets=TARGETS):
    """`program`'s cost over fstop's, with the marks of both: a bound or an estimate if marked."""
    result = []
    for ours, theirs in zip(costs(points, "fstop", targets), costs(points, program, targets)):
        entry = {"target": ours["target"], "mark": theirs["mark"] + ours["mark"].replace("<", ">")}
        for kind in ("gross", "net"):
            both = ours[kind] is not None and theirs[kind] is not None and ours[kind] > 0
            entry[kind] = theirs[kind] / ours[kind] if both else None
        result.append(entry)
    return result


def number(value, mark=""):
    if value is None:
        return "-"
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{mark}{' ' if mark else ''}{value:,.{digits}f}"


def heading(columns):
    return [
        "| scene | program | " + " | ".join(columns) + " | start |",
        "| --- | --- | " + "--- | " * len(columns) + "--- |",
    ]


def row(name, points, program, targets):
    cells = []
    against = ratios(points, program, targets)
    for cost, ratio in zip(costs(points, program, targets), against):
        cell = f"{number(cost['net'], cost['mark'])} ({number(cost['gross'])})"
        if program != "fstop":
            cell += f": {number(ratio['net'], ratio['mark'])}x ({number(ratio['gross'])}x)"
        cells.append(cell)
    start = number(one_sample_cost(points, program))
    return f"| {name} | {program} | " + " | ".join(cells) + f" | {start} |"


def table(result):
    """The costs and ratios of all cases as one Markdown table."""
    heads = [f"{target:.0e}".replace("e-0", "e-") for target in TARGETS]
    lines = heading([f"relMSE {head}" for head in heads])
    for case in result["cases"]:
        for program in result["programs"]:
            if ladder(case["points"], program):
                lines.append(row(case["name"], case["points"], program, TARGETS))
    return "\n".join(lines)


def disc_table(result):
    """The same to errors of the energy of bright points' discs; empty where no scene has any."""
    targets = [target**2 for target in DISC_TARGETS]
    lines = []
    for case in result["cases"]:
        points = by_discs(case["points"])
        for program in result["programs"]:
            if ladder(points, program):
                lines.append(row(case["name"], points, program, targets))
    return "\n".join(heading([f"discs {t:.1%} rms" for t in DISC_TARGETS]) + lines) if lines else ""
