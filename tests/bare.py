"""Run a command as on a machine with nothing but Python, make, git, sh and coreutils.

`python3 tests/bare.py make test`: its PATH is a folder of links to these programs, its environment
HOME, LANG and what pip needs to find packages. Ends with the command's exit code.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COREUTILS = """[ arch b2sum base32 base64 basename basenc cat chcon chgrp chmod chown chroot cksum
comm cp csplit cut date dd df dir dircolors dirname du echo env expand expr factor false fmt fold
groups head hostid id install join link ln logname ls md5sum mkdir mkfifo mknod mktemp mv nice nl
nohup nproc numfmt od paste pathchk pinky pr printenv printf ptx pwd readlink realpath rm rmdir
runcon seq sha1sum sha224sum sha256sum sha384sum sha512sum shred shuf sleep sort split stat stdbuf
stty sum sync tac tail tee test timeout touch tr true truncate tsort tty uname unexpand uniq unlink
users vdir wc who whoami yes"""
PROGRAMS = ("make", "git", "sh", *COREUTILS.split())
KEPT = re.compile("HOME|LANG|PIP_.*|SSL_CERT_.*|REQUESTS_CA_BUNDLE|(HTTPS?|NO|ALL)_PROXY", re.I)


def bare(folder):
    """The environment, with links in a folder to the programs that are there.

    Python is called by its own path: a virtual environment that is made here outlives the folder.
    """
    for name in PROGRAMS:
        if path := shutil.which(name):
            (folder / name).symlink_to(path)
    python = folder / "python3"
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n', encoding="utf-8")
    python.chmod(0o755)
    kept = {name: value for name, value in os.environ.items() if KEPT.fullmatch(name)}
    return {"HOME": str(Path.home()), "LANG": "C.UTF-8", **kept, "PATH": str(folder)}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as tools:
        sys.exit(subprocess.run(sys.argv[1:], env=bare(Path(tools))).returncode)
