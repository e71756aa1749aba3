#!/usr/bin/env python3
"""Writes cannonballs.json, cannonballs_plain.json and falling_cars.json beside this file: a car under cannonballs until a larger
one falls on it, after Jones et al. 2016, figure 7, with and without the flattened example; and the fall alone, side by side.

Sizes, metal and the struck car's mass are theirs. Lighter balls than theirs (600 to 1000 kg) leave the car where the other one falls."""
import math

from scene_writer import colour, ground, vec, write

LENGTH, WIDTH, HEIGHT = 5.51, 2.12, 1.73  # [m]
MASS = 4369  # [kg]
LARGER = 1.5
METAL = {"alpha": 100, "beta": 300, "gamma": 3.33, "lambda": 0.8, "restitution": 0.25}
GOLD, BLUE = colour(0.75, 0.6, 0.12), colour(0.13, 0.3, 0.55)
AWAY = 14  # of a ball from where it will hit [m]


def car(name, place, paint, flattened, factor=1.0, mass=MASS):
    asset = {"shape": {"length": round(factor * LENGTH, 4), "width": round(factor * WIDTH, 4), "height": round(factor * HEIGHT, 4)},
             "cell_size": 0.305 if factor == 1 else 0.46}
    if flattened:
        asset["flattened"] = True
    return {"name": name, "pose": {"position": vec(*place)}, "colour": paint,
            "example": {"asset": {"car": asset}, "parameters": METAL, "mass": mass, "friction": 0.9}}


def cannonballs(flattened):
    bodies = [ground(0.8), car("car", (0, 0.01, 0), GOLD, flattened)]
    script = []
    for k in range(8):  # one after the other, from all round, each at its own height on the car
        angle, speed, mass = 2.4 * k + 0.4, 42 + 18 * k / 7, 150 + 100 * k / 7
        flight = AWAY / speed
        away = (math.cos(angle), 0, math.sin(angle))
        aim = (1.2 * math.cos(3.1 * k), 0.6 + 0.08 * k, 0)
        rise = 9.81 * flight / 2  # so that it comes in level with where it leaves
        place = tuple(a + AWAY * d for a, d in zip(aim, away))
        bodies.append({"name": f"ball {k + 1}", "pose": {"position": vec(*place)}, "colour": colour(0.12, 0.12, 0.13), "asleep": True,
                       "rigid": {"shapes": [{"sphere": {"radius": 0.2}}], "mass": round(mass, 4)}})
        impulse = tuple(mass * v for v in (-speed * away[0], rise, -speed * away[2]))
        script.append({"time": round(0.2 + 0.28 * k, 2),
                       "command": {"apply_impulse": {"body": f"ball {k + 1}", "impulse": vec(*impulse), "point": vec(*place)}}})
    bodies.append(car("second car", (0.4, 40, 0.3), BLUE, flattened, LARGER, 60000))
    way = "with" if flattened else "without"
    return {"name": "cannonballs" if flattened else "cannonballs_plain",
            "description": f"A car under eight cannonballs, until a larger one falls on it, {way} a flattened example, after Jones et al. 2016, figure 7.",
            "dt": 0.002, "bodies": bodies, "script": script, "recording": {"every": 8}}


def falling_cars():
    bodies = [ground(0.8)]
    for name, x, flattened in (("with", -5, True), ("without", 5, False)):
        bodies.append(car(f"car {name}", (x, 0.01, 0), GOLD, flattened))
        bodies.append(car(f"car above {name}", (x - 0.35, 25, 0), BLUE, flattened, LARGER, 14745))
    return {"name": "falling_cars",
            "description": "A larger car falls on a car twice: left the flattened example is among theirs, right not, after Jones et al. 2016, figure 7.",
            "dt": 0.002, "bodies": bodies, "recording": {"every": 8}}


for scene in (cannonballs(True), cannonballs(False), falling_cars()):
    write(scene)
