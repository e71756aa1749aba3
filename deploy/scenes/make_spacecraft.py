#!/usr/bin/env python3
"""Writes space.json and shipyard.json beside this file: scenes of many jointed parts, after Jones et al. 2016, figures 9 and 10.

Numbers are those of `crumple-lab bench space` and `shipyard` (server/lab/spacecraft_scenes.cpp) where not said otherwise. Here there
are fewer fighters, slower, and a heavier ship in the yard; cranes are trusses, ships have engines and fins, containers stand about."""
import math
import random

from scene_writer import colour, ground, vec, write


def between(a, b, t):
    return tuple(p + t * (q - p) for p, q in zip(a, b))


def loft(axis, stations, sides=16, power=2, every=None):
    """stations: (centre, width, height) each. every: further stations between them, at most so far apart [m]; the shape is the
    same, but what is drawn bends between them."""
    along = "XYZ".index(axis)
    if every:
        finer = stations[:1]
        for (c0, w0, h0), (c1, w1, h1) in zip(stations, stations[1:]):
            parts = math.ceil((c1[along] - c0[along]) / every)
            finer += [(between(c0, c1, k / parts), w0 + (w1 - w0) * k / parts, h0 + (h1 - h0) * k / parts) for k in range(1, parts + 1)]
        stations = finer
    return {"axis": axis, "sides": sides, "power": power,
            "stations": [{"centre": vec(*s[0]), "width": round(s[1], 4), "height": round(s[2], 4)} for s in stations]}


def bar(a, b, thick):
    """A square bar from a to b, with its ends across the axis that it is nearest to."""
    along = max(range(3), key=lambda k: abs(b[k] - a[k]))
    low, high = sorted((a, b), key=lambda p: p[along])
    return loft("XYZ"[along], [(low, thick, thick), (high, thick, thick)], sides=4, power=2)


def box(low, high):
    """A box with its edges along the axes."""
    centre = between(low, high, 0.5)
    size = tuple(q - p for p, q in zip(low, high))
    return loft("Y", [((centre[0], low[1], centre[2]), size[0], size[2]), ((centre[0], high[1], centre[2]), size[0], size[2])], power=30)


def asset(lofts, cell, bones, parts):
    return {"default_rig": {"surface": {"loft": {"parts": lofts}}, "cell_size": cell, "bones": bones, "convex_parts": parts}}


def turn_y(angle, p):
    c, s = math.cos(angle), math.sin(angle)
    return (c * p[0] + s * p[2], p[1], -s * p[0] + c * p[2])


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def body(name, place, angle, paint, source, mass, metal, velocity=(0, 0, 0)):
    result = {"name": name, "pose": {"position": vec(*place), "rotation_vector": vec(0, angle, 0)},
              "colour": colour(*paint),
              "example": {"asset": source, "parameters": metal, "mass": mass}}
    if any(velocity):
        result["velocity"] = vec(*velocity)
    return result


def joint(a, b, place, strength, bending):
    return {"a": a, "b": b, "position": vec(*place), "strength": strength, "bending": bending}


FUSELAGE = loft("X", [((-6.5, 0.1, 0), 1.4, 1.0), ((-5, 0.1, 0), 2.4, 1.9), ((-1.5, 0.2, 0), 2.6, 2.4), ((1.5, 0.2, 0), 2.0, 2.0),
                      ((4.5, -0.1, 0), 1.2, 1.1), ((7, -0.3, 0), 0.4, 0.4)], power=2.5, every=0.75)
COCKPIT = loft("X", [((-0.8, 1.1, 0), 0.5, 0.3), ((0.2, 1.2, 0), 1.0, 0.9), ((1.6, 1.0, 0), 0.9, 0.7), ((2.8, 0.6, 0), 0.4, 0.3)], every=0.5)
FIN = loft("Y", [((-5.2, 0.8, 0), 2.4, 0.3), ((-6.3, 3.2, 0), 1.2, 0.16)], power=4, every=0.6)
ENGINES = [loft("X", [((-7.4, 0, z), 1.0, 1.0), ((-6.4, 0, z), 1.25, 1.25), ((-3.4, 0, z), 0.9, 0.9)], sides=12, every=0.75) for z in (-1, 1)]
FIGHTER = [FUSELAGE, COCKPIT, FIN] + ENGINES


def wing(side):
    stations = [((-1.6, 0, 1.0 * side), 6, 0.8), ((-2.4, -0.2, 3.4 * side), 4.2, 0.6), ((-3.4, -0.5, 6.5 * side), 2.2, 0.45)]
    return loft("Z", stations if side > 0 else stations[::-1], every=0.6)


LARGE_SHIP = [
    loft("X", [((-62, 0, 0), 14, 10), ((-50, 0, 0), 26, 16), ((-20, 0, 0), 30, 18), ((10, -1, 0), 24, 15), ((40, -2, 0), 14, 9),
               ((62, -3, 0), 4, 3)], sides=32, power=3, every=3),
    loft("Y", [((-30, 7, 0), 24, 12), ((-33, 14, 0), 14, 9), ((-34, 19, 0), 8, 7)], power=4, every=3),
    loft("Y", [((-36, 18, 0), 0.9, 0.9), ((-36, 27, 0), 0.3, 0.3)], sides=8)] + [
    loft("X", [((-66, 0, 17 * side), 8, 8), ((-58, 0, 17 * side), 6, 6), ((-35, 0, 17 * side), 8, 8), ((-24, 0, 15 * side), 4, 4)], every=3)
    for side in (-1, 1)] + [  # turrets, each with its gun
    part for x, top, size in ((-8, 8.2, 5), (8, 6.6, 4.4), (24, 4.2, 3.6))
    for part in (loft("Y", [((x, top - 2, 0), size, size), ((x, top + 1.6, 0), 0.8 * size, 0.8 * size)], sides=8, power=3),
                 loft("X", [((x, top + 0.8, 0), 0.9, 0.9), ((x + 2.2 * size, top + 1.2, 0), 0.6, 0.6)], sides=8))]


def mast(low, high):
    """Four legs, and five bays of bars between them."""
    r, bays = 0.9, 5
    corners = [(r, r), (-r, r), (-r, -r), (r, -r)]
    levels = [low + (high - low) * k / bays for k in range(bays + 1)]
    parts = [bar((x, low, z), (x, high, z), 0.3) for x, z in corners]
    for k, y in enumerate(levels):
        for (x0, z0), (x1, z1) in zip(corners, corners[1:] + corners[:1]):
            parts.append(bar((x0, y, z0), (x1, y, z1), 0.18))
            if k < bays:  # to and fro
                (xa, za), (xb, zb) = ((x0, z0), (x1, z1)) if k % 2 == 0 else ((x1, z1), (x0, z0))
                parts.append(bar((xa, y, za), (xb, levels[k + 1] + 1e-3, zb), 0.18))
    return parts


def jib(near, far, bays, tie):
    """A truss of one upper and two lower chords from x = near to far, and the tie that it hangs on."""
    xs = [near + (far - near) * k / bays for k in range(bays + 1)]
    low, high, half = 19.5, 20.9, 0.7
    parts = [bar((near, high, 0), (far, high - 0.5, 0), 0.26)] + [bar((near, low, z), (far, low + 0.3, z), 0.26) for z in (-half, half)]
    for k, x in enumerate(xs):
        y = low + 0.3 * k / bays
        parts.append(bar((x, y, -half), (x, y, half), 0.18))
        if k < bays:
            middle = between((x, 0, 0), (xs[k + 1], 0, 0), 0.5)[0]
            top = high - 0.5 * (k + 0.5) / bays
            for z in (-half, half):
                parts += [bar((x, y, z), (middle, top, 0), 0.16), bar((middle, top, 0), (xs[k + 1], low + 0.3 * (k + 1) / bays, z), 0.16)]
    return parts + [bar((near, 23.4, 0), (tie, high, 0), 0.16)]


HEAD = [loft("Y", [((0, 18, 0), 2.6, 2.6), ((0, 18.7, 0), 2.2, 2.2)], sides=12), box((0.4, 18.8, 0.9), (2.2, 20.9, 2.4))] + [
    bar((0.8 * x, 18.7, 0.8 * z), (0.15 * x, 24, 0.15 * z), 0.3) for x, z in ((1, 1), (-1, 1), (-1, -1), (1, -1))] + [
    loft("Y", [((0, 23.4, 0), 0.8, 0.8), ((0, 24.2, 0), 0.5, 0.5)], sides=8)]

CRANE = [  # part, mass [kg], bones, convex parts, where it is joined, to which part (-1: the ground)
    (mast(0, 9), 8e3, 3, 1, (0, 0, 0), -1),
    (mast(9, 18), 8e3, 3, 1, (0, 9, 0), 0),
    (HEAD, 5e3, 2, 1, (0, 18, 0), 1),
    (jib(0.9, 17, 8, 11.9), 4e3, 3, 2, (0.9, 20, 0), 2),
    (jib(-0.9, -8, 4, -6.2) + [box((-8.6, 18.2, -1.1), (-6.4, 20.4, 1.1))], 7e3, 3, 2, (-0.9, 20, 0), 2)]

CONTAINER = (6.1, 2.6, 2.44)  # [m]
STACKS = [(-24, 9, 0.1, 3), (-16, 10.5, 0.05, 2), (-4, 9.5, -0.1, 3), (9, -9.5, 0.15, 3), (17, -11, -0.05, 2), (26, -9, 0.1, 3)]  # x, z, turned, high


def space():
    draw = random.Random(1)
    metal = {"alpha": 60, "beta": 2000, "gamma": 3, "lambda": 0.9}
    bodies = [body("ship", (0, 0, 0), 0, (0.5, 0.52, 0.56), asset(LARGE_SHIP, 3.45, 64, 5), 8e6,
                   {"alpha": 3000, "beta": 2e4, "gamma": 12, "lambda": 0.95})]
    joints = []
    rows = [1, 3, 4]
    for row, count in enumerate(rows):
        for k in range(count):
            name = f"fighter {sum(rows[:row]) + k + 1}"
            angle = math.pi / 2 + draw.uniform(-0.1, 0.1)
            place = (-8 + 20 * (k - (count - 1) / 2) + draw.uniform(-1, 1), draw.uniform(-3, 3), 60 + 22 * row)
            paint = [(0.75, 0.2, 0.15), (0.8, 0.55, 0.15), (0.2, 0.4, 0.65)][row]
            speed = (0, 0, -60)
            bodies.append(body(name, place, angle, paint, asset(FIGHTER, 0.73, 6, 3), 14e3, metal, speed))
            for side, word in ((-1, "left"), (1, "right")):
                bodies.append(body(f"{name} {word} wing", place, angle, paint, asset([wing(side)], 0.73, 3, 1), 3e3, metal, speed))
                for x in (-1.5, 1.5):
                    joints.append(joint(name, f"{name} {word} wing", add(place, turn_y(angle, (-1.6 + x, 0, 1.1 * side))), 1.5e6, 1.5e6))
    return {"name": "space", "description": "A fleet flies into a ship of 124 m and loses its wings, after Jones et al. 2016, figure 10.",
            "dt": 0.002, "joint_time": 0, "gravity": {}, "bodies": bodies, "joints": joints, "recording": {"every": 8}}


def shipyard():
    bodies = [ground()]
    joints = []
    ship = body("ship", (-40, 15, 0), 0, (0.75, 0.2, 0.15), asset(FIGHTER + [wing(-1), wing(1)], 0.5, 12, 6), 80e3,
                {"alpha": 150, "beta": 5000, "gamma": 3, "lambda": 0.95}, (55, -1, 0))
    bodies.append(ship)
    for crane in range(3):
        angle, place = (1.2, -1.4, 1.7)[crane], (-12 + 16 * crane, 0, -1.5 + 1.5 * crane)
        for k, (part, mass, bones, convex, at, under) in enumerate(CRANE):
            bodies.append(body(f"crane {crane + 1} part {k + 1}", place, angle, (0.85, 0.65, 0.1), asset(part, 0.78, bones, convex), mass,
                               {"alpha": 250, "beta": 2000, "gamma": 3, "lambda": 0.95}))
            joints.append(joint(f"crane {crane + 1} part {k + 1}", "ground" if under < 0 else f"crane {crane + 1} part {under + 1}",
                                add(place, turn_y(angle, at)), 1.2e6, 1.5e6))
    paints = [(0.5, 0.16, 0.12), (0.13, 0.28, 0.45), (0.2, 0.36, 0.2), (0.55, 0.35, 0.1)]
    half = {k: v / 2 for k, v in zip("xyz", CONTAINER)}
    for stack, (x, z, angle, high) in enumerate(STACKS):
        for k in range(high):
            bodies.append({"name": f"container {stack + 1} {k + 1}", "colour": colour(*paints[(stack + k) % 4]), "asleep": True,
                           "pose": {"position": vec(x, CONTAINER[1] * (k + 0.5), z), "rotation_vector": vec(0, angle, 0)},
                           "rigid": {"shapes": [{"box": {"half_extents": half}}], "mass": 6000}})
    return {"name": "shipyard", "description": "A ship flies through three cranes, which come apart, after Jones et al. 2016, figure 9.",
            "dt": 1 / 480, "joint_time": 0, "bodies": bodies, "joints": joints, "recording": {"every": 8}}


for scene in (space(), shipyard()):
    write(scene)
