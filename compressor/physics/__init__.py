"""The mechanics: numbers in, numbers out; only numpy and the one door to numba."""

from compressor.physics.contact import choose_laws
from compressor.physics.contact_laws import elastic_form
from compressor.physics.film import short_film
from compressor.physics.kinematics import exact_motion
from compressor.physics.loads import (
    complete,
    gas_corners,
    greatest_load,
    sample_segments,
    segments,
    static_load,
)
from compressor.physics.march import Status, march, new_stepper, new_work, rehearse
from compressor.physics.mechanism_rows import STALLED
from compressor.physics.observe import COLUMNS, WIDE, Column, frame_of_series
from compressor.physics.onset import approach_at
from compressor.physics.record import (
    CARD_NODES,
    FILM_TERMS,
    Coordinate,
    Fields,
    Load,
    Scene,
    has_chosen_forces,
    is_featured,
    new_record,
    read_fields,
    state_names,
)
from compressor.physics.runge_kutta import FLOWS
from compressor.physics.step_control import STABILITY_LIMIT, Mode
from compressor.physics.systems import (
    beyond_model,
    derivative_with_flows,
    enter_segment,
    ideal_forces,
    observe_all,
    start,
)
from compressor.physics.tally import (
    GREATEST,
    MEANS,
    ROD_LOAD,
    SQUARES,
    add_flows,
    cut_tally,
    lobatto,
    merge_tallies,
    new_tally,
    tally_each,
    tally_energy,
)
