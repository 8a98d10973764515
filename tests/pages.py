"""What the page of a replay holds."""

import base64
import json
import re
import struct
import zlib

import numpy as np


def held(page: str) -> dict:
    """The dictionary and the arrays that a page shows."""
    text = re.search(r'id="run">([^<]*)<', page).group(1)
    data = zlib.decompress(base64.b64decode(text))
    (count,) = struct.unpack("<I", data[:4])
    found = json.loads(data[4 : 4 + count])
    for name, (kind, start, size) in found["arrays"].items():
        found[name] = np.frombuffer(data, kind, size, 4 + count + start)
    return found
