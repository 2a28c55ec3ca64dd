"""`compsim completion`: what makes a shell complete commands, files, studies and jobs."""

import sys

import click
from click.shell_completion import get_completion_class

from compsim.screen import DONE, print_text, say

INSTALL = {
    "bash": """echo 'eval "$(compsim completion bash)"' >> ~/.bashrc""",
    "zsh": """echo 'eval "$(compsim completion zsh)"' >> ~/.zshrc""",
    "fish": "compsim completion fish > ~/.config/fish/completions/compsim.fish",
}


@click.command()
@click.argument("shell", required=False, metavar="[SHELL]", type=click.Choice([*INSTALL]))
@click.pass_context
def completion(context: click.Context, shell: str | None) -> int:
    """Print the script by which a shell completes compsim's words.

    It completes commands, options, case files, studies and jobs. Enter the line of your shell once,
    and it works in every new shell; without a SHELL these lines are printed:

    \b
    bash  echo 'eval "$(compsim completion bash)"' >> ~/.bashrc
    zsh   echo 'eval "$(compsim completion zsh)"' >> ~/.zshrc
    fish  compsim completion fish > ~/.config/fish/completions/compsim.fish
    """
    if shell is None:
        for name, line in INSTALL.items():
            print_text(f"{name:<5} {line}")
        return DONE
    kind = get_completion_class(shell)
    root = context.find_root().command
    assert kind is not None
    print_text(kind(root, {}, "compsim", "_COMPSIM_COMPLETE").source())
    if sys.stdout.isatty():
        say(f"to install it: {INSTALL[shell]}; then open a new shell")
    return DONE
