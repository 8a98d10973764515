#!/usr/bin/env bash
# Where two meet: a 3MF file of trimesh, read by lib3mf, the library of the 3MF consortium.
#
# Common guess: a box that trimesh exports is read by lib3mf in strict mode, as the file is valid XML
# with the core and the production namespace.
# Versions: trimesh 5.2.0, lib3mf 2.5.0 (Linux, Python 3.11).
# Behaviour: trimesh declares all namespaces again on each <item> of the build. lib3mf takes these
# declarations for attributes: its tolerant reader warns, its strict reader refuses the file. Without
# the second declarations, which say nothing new, the same file is read.
# Output seen:
#   tolerant reader: 1 mesh, warning: Invalid Attribute in namespace.
#   strict reader: Lib3MFException 5: Invalid Attribute in namespace.
#   strict reader without declarations on <item>: read
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet trimesh==5.2.0 networkx==3.6.1 lxml==6.1.3 lib3mf==2.5.0
cat > meet.py <<'PY'
import re
import zipfile

import lib3mf
import trimesh


def read(path, strict):
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(strict)
    try:
        reader.ReadFromFile(path)
    except lib3mf.ELib3MFException as error:
        return str(error)
    meshes = model.GetMeshObjects().Count()
    warnings = {reader.GetWarning(k)[1] for k in range(reader.GetWarningCount())}
    words = ", ".join(sorted(warnings))
    return "read" if strict else f"{meshes} mesh, warning: {words}"


def without_declarations_on_items(path, to):
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(to, "w") as new:
        for name in old.namelist():
            data = old.read(name).decode()
            new.writestr(name, re.sub(r'<item (?:xmlns(?::\w+)?="[^"]*" ?)+', "<item ", data))


trimesh.creation.box((10, 20, 30)).export("box.3mf")
without_declarations_on_items("box.3mf", "once.3mf")
print("tolerant reader:", read("box.3mf", False))
print("strict reader:", read("box.3mf", True))
print("strict reader without declarations on <item>:", read("once.3mf", True))
PY
v/bin/python meet.py | tee seen
diff seen - <<'SEEN'
tolerant reader: 1 mesh, warning: Invalid Attribute in namespace.
strict reader: Lib3MFException 5: Invalid Attribute in namespace.
strict reader without declarations on <item>: read
SEEN
