#!/bin/sh
# Install cmmlink from this folder, without a network: ./install.sh [FOLDER]. Python @PYTHON@ has to be there; it needs no administrator.
# FOLDER is where it is installed, ~/cmmlink where none is given. A menu entry opens the console with the plans in FOLDER/plans.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:-$HOME/cmmlink}
python=${PYTHON:-python@PYTHON@}

command -v "$python" >/dev/null || { echo "Python @PYTHON@ was not found. Install it, or say where it is: PYTHON=/path/to/python ./install.sh" >&2; exit 1; }
"$python" -c 'import sys; sys.exit(sys.version_info[:2] != tuple(map(int, "@PYTHON@".split("."))))' || {
    echo "This folder is for Python @PYTHON@, and $python is $("$python" -V)." >&2
    exit 1
}
"$python" -c 'import ensurepip' 2>/dev/null || { echo "This Python cannot make virtual environments. On Debian or Ubuntu: apt install python@PYTHON@-venv" >&2; exit 1; }

mkdir -p "$folder/plans"
folder=$(cd "$folder" && pwd)
"$python" -m venv "$folder/program"
"$folder/program/bin/python" -m pip install --quiet --disable-pip-version-check --no-index --find-links "$here/wheels" --requirement "$here/versions.txt" cmmlink
cp "$here/cmmlink.png" "$folder/cmmlink.png"
"$folder/program/bin/cmmlink" prepare

if [ "$(uname)" = Linux ]; then
    menu=${XDG_DATA_HOME:-$HOME/.local/share}/applications
    mkdir -p "$menu"
    # Every value has its backslashes doubled; before that, what a shell takes for its own stands behind one in quotes, and % is doubled.
    plain=$(printf '%s' "$folder" | sed 's/\\/\\\\/g')
    quoted=$(printf '%s' "$folder" | sed 's/[\\"`$]/\\&/g; s/%/%%/g; s/\\/\\\\/g')
    cat >"$menu/cmmlink.desktop" <<END
[Desktop Entry]
Type=Application
Name=cmmlink
GenericName=Coordinate measuring
Comment=The operator console: measure parts by the plans in $plain/plans
Comment[de]=Messplatz: Teile nach den Plänen in $plain/plans messen
Exec="$quoted/program/bin/cmmlink" console "$quoted/plans"
Icon=$plain/cmmlink.png
Terminal=true
Categories=Science;Engineering;
END
    echo "The menu has an entry cmmlink: $menu/cmmlink.desktop"
fi
echo "Installed. The console: $folder/program/bin/cmmlink console $folder/plans"
