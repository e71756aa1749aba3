"""What the scene generators of this folder share. Standard library only."""
import json
import pathlib

HERE = pathlib.Path(__file__).parent


def vec(x, y, z):
    return {k: round(v, 4) for k, v in zip("xyz", (x, y, z)) if abs(v) > 1e-9}


def colour(r, g, b):
    return {"r": r, "g": g, "b": b}


def ground(friction=None):
    rigid = {"kind": "FIXED", "shapes": [{"plane": {}}]}
    if friction is not None:
        rigid["friction"] = friction
    return {"name": "ground", "colour": colour(0.42, 0.43, 0.45), "rigid": rigid}


def write(scene):
    """Writes <name>.json: a field a line, an element of a list a line."""
    fields = []
    for key, value in scene.items():
        if isinstance(value, list):
            items = ",\n".join(f"    {json.dumps(item)}" for item in value)
            fields.append(f'  "{key}": [\n{items}\n  ]')
        else:
            fields.append(f'  "{key}": {json.dumps(value)}')
    (HERE / f"{scene['name']}.json").write_text("{\n" + ",\n".join(fields) + "\n}\n")
