#!/usr/bin/env bash
# Does the built wheel hold everything? Installs it, without this source tree, into a fresh environment
# that borrows only the dependencies of .venv, and uses it from another folder.
set -euo pipefail
cd "$(dirname "$0")/.."
project_python=$PWD/.venv/bin/python
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# by way of the source archive, so that nothing left in build/ gets in
"$project_python" -m build --outdir "$work/dist" . >"$work/build.log" 2>&1 || { cat "$work/build.log"; exit 1; }

"$project_python" -m venv --without-pip "$work/venv"
python=$work/venv/bin/python
"$project_python" -m pip --python "$python" install --quiet --no-deps "$work"/dist/*.whl
# a .pth inside a folder that a .pth adds is not read: the editable install of .venv stays out
site_packages='import sysconfig; print(sysconfig.get_path("purelib"))'
"$project_python" -c "$site_packages" >"$("$python" -c "$site_packages")/dependencies.pth"

cd "$work"
"$python" -c '
import pathlib, sys
import rebody
assert pathlib.Path(rebody.__file__).is_relative_to(sys.prefix), rebody.__file__
assert pathlib.Path(rebody.__file__).with_name("py.typed").is_file()
'
venv/bin/rebody list
venv/bin/rebody report position # its template is data of the package
echo "the wheel works"
