"""A room for heaps that are built or hung up: two lamps, two walls and a floor."""

ROOM = {
    "heap": [0, 0, 1],
    "surfaces": {
        "back": {"point": [0, 0.5, 0], "normal": [0, 1, 0]},
        "side": {"point": [-0.5, 0, 0], "normal": [1, 0, 0]},
        "floor": {"point": [0, 0, 0.5], "normal": [0, 0, 1]},
    },
    "lamps": [
        {"at": [0, -0.6, 1], "onto": "back", "height": 0.4},
        {"at": [0.6, 0, 1], "onto": "side", "height": 0.4},
    ],
}
