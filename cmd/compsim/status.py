"""`compsim status`: how many jobs of each stored study are done, and how far to trust them."""

import click

from compressor.digits import align_columns, plural
from compsim import options, screen

PROMISES = {
    "kept": "reached their accuracy target", "none": "without an accuracy target",
    "chaotic": "chaotic (no accuracy target can hold)",
}  # fmt: skip


@click.command()
@options.results
@options.as_json
def status(folder, as_json) -> int:
    """Count jobs that are done, failed or missing, and say why.

    \b
    compsim status
    compsim status -r /data/results

    One line a study. Of those that are ok, also how many reached their accuracy target, how many
    move periodically, predictably or chaotically, how many were not seen to repeat, whose sensor
    record is clipped, and which keys are outside the range in which the program was tested.
    """
    from compressor.outcome import regime_words
    from compressor.reasons import remedy
    from compressor.store import standings

    found = standings(folder)
    if as_json:
        screen.print_json(found)
        return screen.DONE
    rows = []
    for one in found:
        ends = f"{one.ok} ok", f"{one.failed} failed", f"{one.missing} missing"
        rows.append((one.study, plural(one.jobs), *ends))
    for line, one in zip(align_columns(rows, "<>>>>"), found, strict=True):
        promises = [f"{n} {PROMISES[word]}" for word, n in one.promises.items() if word in PROMISES]
        trusted = [", ".join(promises)] if promises else []
        trusted += [f"{n} {regime_words(word)}" for word, n in one.regimes.items() if word]
        remarks = [f"of those ok: {text}" for text in trusted] + one.caveats
        remarks += [f"{n} {reason}: {remedy(reason)}" for reason, n in one.reasons.items()]
        screen.print_text(line)
        for text in remarks:
            screen.print_text(*screen.wrap_line(text, 4))
    wanting = [one.again for one in found if one.missing]
    for command in screen.run_commands(wanting, folder):
        screen.say(f"next: {command}")
    return screen.DONE
