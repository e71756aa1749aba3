#!/usr/bin/env python3
"""Writes space.json and shipyard.json beside this file: scenes of many jointed parts, after Jones et al. 2016, figures 9 and 10.

Standard library only. Numbers are those of `crumple-lab bench space` and `shipyard` (server/lab/spacecraft_scenes.cpp) where not said
otherwise: here fewer fighters, slower, and a heavier ship in the yard."""
import json
import math
import pathlib
import random

HERE = pathlib.Path(__file__).parent


def vec(x, y, z):
    return {k: round(v, 4) for k, v in zip("xyz", (x, y, z)) if abs(v) > 1e-9}


def loft(axis, stations, sides=16, power=2):
    return {"axis": axis, "sides": sides, "power": power,
            "stations": [{"centre": vec(*s[0]), "width": s[1], "height": s[2]} for s in stations]}


def asset(lofts, cell, bones, parts):
    return {"default_rig": {"surface": {"loft": {"parts": lofts}}, "cell_size": cell, "bones": bones, "convex_parts": parts}}


def turn_y(angle, p):
    c, s = math.cos(angle), math.sin(angle)
    return (c * p[0] + s * p[2], p[1], -s * p[0] + c * p[2])


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def body(name, place, angle, colour, source, mass, metal, velocity=(0, 0, 0)):
    result = {"name": name, "pose": {"position": vec(*place), "rotation_vector": vec(0, angle, 0)},
              "colour": dict(zip("rgb", colour)),
              "example": {"asset": source, "parameters": metal, "mass": mass}}
    if any(velocity):
        result["velocity"] = vec(*velocity)
    return result


def joint(a, b, place, strength, bending):
    return {"a": a, "b": b, "position": vec(*place), "strength": strength, "bending": bending}


FUSELAGE = loft("X", [((-6.5, 0.1, 0), 1.4, 1.0), ((-5, 0.1, 0), 2.4, 1.9), ((-1.5, 0.2, 0), 2.6, 2.4), ((1.5, 0.2, 0), 2.0, 2.0),
                      ((4.5, -0.1, 0), 1.2, 1.1), ((7, -0.3, 0), 0.4, 0.4)], power=2.5)


def wing(side):
    stations = [((-1.6, 0, 1.0 * side), 6, 0.8), ((-2.4, -0.2, 3.4 * side), 4.2, 0.6), ((-3.4, -0.5, 6.5 * side), 2.2, 0.45)]
    return loft("Z", stations if side > 0 else stations[::-1])


LARGE_SHIP = [
    loft("X", [((-62, 0, 0), 14, 10), ((-50, 0, 0), 26, 16), ((-20, 0, 0), 30, 18), ((10, -1, 0), 24, 15), ((40, -2, 0), 14, 9),
               ((62, -3, 0), 4, 3)], sides=24, power=3),
    loft("Y", [((-30, 7, 0), 24, 12), ((-33, 14, 0), 14, 9), ((-34, 19, 0), 8, 7)], power=4)] + [
    loft("X", [((-60, 0, 17 * side), 6, 6), ((-35, 0, 17 * side), 8, 8), ((-24, 0, 15 * side), 4, 4)]) for side in (-1, 1)]


def mast(low, high):
    return loft("Y", [((0, y, 0), 1.8, 1.8) for y in (low, (low + high) / 2, high)], sides=12, power=6)


CRANE = [  # part, mass [kg], bones, convex parts, where it is joined, to which part (-1: the ground)
    (mast(0, 9), 8e3, 3, 1, (0, 0, 0), -1),
    (mast(9, 18), 8e3, 3, 1, (0, 9, 0), 0),
    (loft("Y", [((0, 18, 0), 2.4, 2.4), ((0, 21, 0), 2.0, 2.0), ((0, 24, 0), 0.8, 0.8)], sides=12, power=4), 5e3, 2, 1, (0, 18, 0), 1),
    (loft("X", [((0.9, 20, 0), 1.5, 1.7), ((9, 20.1, 0), 1.3, 1.4), ((17, 20.2, 0), 0.9, 0.9)], sides=12, power=6), 4e3, 3, 2, (0.9, 20, 0), 2),
    (loft("X", [((-8, 19.6, 0), 2.6, 2.6), ((-6, 19.6, 0), 2.6, 2.6), ((-5, 20, 0), 1.3, 1.4), ((-0.9, 20, 0), 1.5, 1.7)], sides=12, power=6),
     7e3, 3, 2, (-0.9, 20, 0), 2)]


def space():
    draw = random.Random(1)
    metal = {"alpha": 30, "beta": 2000, "gamma": 3, "lambda": 0.9}
    bodies = [body("ship", (0, 0, 0), 0, (0.5, 0.52, 0.56), asset(LARGE_SHIP, 3.45, 64, 5), 8e6,
                   {"alpha": 3000, "beta": 2e4, "gamma": 12, "lambda": 0.95})]
    joints = []
    rows = [1, 3, 4]
    for row, count in enumerate(rows):
        for k in range(count):
            name = f"fighter {sum(rows[:row]) + k + 1}"
            angle = math.pi / 2 + draw.uniform(-0.1, 0.1)
            place = (-8 + 20 * (k - (count - 1) / 2) + draw.uniform(-1, 1), draw.uniform(-3, 3), 60 + 22 * row)
            colour = [(0.75, 0.2, 0.15), (0.8, 0.55, 0.15), (0.2, 0.4, 0.65)][row]
            speed = (0, 0, -60)
            bodies.append(body(name, place, angle, colour, asset([FUSELAGE], 0.73, 6, 3), 14e3, metal, speed))
            for side, word in ((-1, "left"), (1, "right")):
                bodies.append(body(f"{name} {word} wing", place, angle, colour, asset([wing(side)], 0.73, 3, 1), 3e3, metal, speed))
                for x in (-1.5, 1.5):
                    joints.append(joint(name, f"{name} {word} wing", add(place, turn_y(angle, (-1.6 + x, 0, 1.1 * side))), 1.5e6, 1.5e6))
    return {"name": "space", "description": "A fleet flies into a ship of 124 m and loses its wings, after Jones et al. 2016, figure 10.",
            "dt": 0.002, "joint_time": 0, "gravity": {}, "bodies": bodies, "joints": joints, "recording": {"every": 8}}


def shipyard():
    bodies = [{"name": "ground", "colour": {"r": 0.42, "g": 0.43, "b": 0.45}, "rigid": {"kind": "FIXED", "shapes": [{"plane": {}}]}}]
    joints = []
    ship = body("ship", (-40, 15, 0), 0, (0.75, 0.2, 0.15), asset([FUSELAGE], 0.5, 12, 4), 80e3,
                {"alpha": 30, "beta": 5000, "gamma": 3, "lambda": 0.95}, (55, -1, 0))
    bodies.append(ship)
    for crane in range(3):
        angle, place = (1.2, -1.4, 1.7)[crane], (-12 + 16 * crane, 0, -1.5 + 1.5 * crane)
        for k, (part, mass, bones, convex, at, under) in enumerate(CRANE):
            bodies.append(body(f"crane {crane + 1} part {k + 1}", place, angle, (0.85, 0.65, 0.1), asset([part], 0.78, bones, convex), mass,
                               {"alpha": 60, "beta": 2000, "gamma": 2, "lambda": 0.95}))
            joints.append(joint(f"crane {crane + 1} part {k + 1}", "ground" if under < 0 else f"crane {crane + 1} part {under + 1}",
                                add(place, turn_y(angle, at)), 1.2e6, 1.5e6))
    return {"name": "shipyard", "description": "A ship flies through three cranes, which come apart, after Jones et al. 2016, figure 9.",
            "dt": 1 / 480, "joint_time": 0, "bodies": bodies, "joints": joints, "recording": {"every": 8}}


def write(scene):
    entries = {key: scene[key] for key in scene}
    lines = ["{"]
    for key, value in entries.items():
        comma = "" if key == list(entries)[-1] else ","
        if isinstance(value, list):
            lines.append(f'  "{key}": [')
            lines += [f"    {json.dumps(item)}" + ("," if item is not value[-1] else "") for item in value]
            lines.append(f"  ]{comma}")
        else:
            lines.append(f'  "{key}": {json.dumps(value)}{comma}')
    (HERE / f"{scene['name']}.json").write_text("\n".join(lines) + "\n}\n")


for make in (space, shipyard):
    write(make())
