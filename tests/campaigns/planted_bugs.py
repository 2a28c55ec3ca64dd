"""Thirty bugs of the kinds that such a program gets: name, file, text, what stands in its place."""

from mutation import planted

BUGS = [
    # contact
    ("friction pushes along the slip", "physics/contact.py",
     "-friction_coefficient(slip, bristle", "friction_coefficient(slip, bristle"),
    ("K a hundredth too large", "physics/contact_laws.py",
     "return stiffness * power", "return 1.01 * stiffness * power"),
    ("STEP is a parabola", "physics/contact_laws.py", "(3.0 - 2.0 * s)", "1.0"),
    ("contact pulls", "physics/contact_laws.py",
     "return max(0.0, unclamped), unclamped", "return unclamped, unclamped"),
    ("the bore's radius is the pin's", "physics/contact.py",
     "distance - clearance, pin + clearance", "distance - clearance, pin"),
    ("journal and bearing swapped in the slip", "physics/contact.py",
     "spins[0] * (pin - penetration) - spins[1] * bore",
     "spins[1] * bore - spins[0] * (pin - penetration)"),
    # motion
    ("the rod's centripetal term lost", "physics/motion.py",
     "contact.fx - load - p.rod_mass * b * at.cos_phi * at.rate * at.rate", "contact.fx - load"),
    ("gravity upwards", "physics/motion.py",
     "* p.per_rod_mass - p.gravity", "* p.per_rod_mass + p.gravity"),
    ("friction's moment at the small end turned", "physics/motion.py",
     "big.moment + small.moment", "big.moment - small.moment"),
    ("journal and bearing swapped at the small end", "physics/motion.py",
     "at.small, (0.0, -at.rate), y, p)", "at.small, (-at.rate, 0.0), y, p)"),
    ("the rod's inertia about its mass centre", "physics/motion.py",
     "p.rod_inertia + p.rod_mass * b * b", "p.rod_inertia"),
    ("an offset the other way", "physics/systems.py",
     "y[place + 1] = offset[joint, 0]", "y[place + 1] = -offset[joint, 0]"),
    # kinematics, loads, cam
    ("a lost term of the rod's ideal spin-up", "physics/kinematics.py",
     "(rate * rate - p.omega * p.omega)", "(-p.omega * p.omega)"),
    ("a wrong term of the series of cosine", "physics/kinematics.py",
     "C4, C6, C8 = 1 / 24", "C4, C6, C8 = 1 / 12"),
    ("the stroke is a radius, not a diameter", "physics/loads.py",
     "suction_force * ((clearance + 2.0 * p.crank_radius)",
     "suction_force * ((clearance + p.crank_radius)"),
    ("the cam does not close", "physics/loads.py",
     "angle_at(rod_length - crank_radius + stroke", "angle_at(rod_length + crank_radius - stroke"),
    ("the follower's lift is the spring's stroke", "analysis/cam.py",
     "top - self.p.spring_stroke)", "top - 2.0 * self.p.crank_radius + self.p.spring_stroke)"),
    # record
    ("K as the paper prints it, per mm", "cases/materials.py",
     "1000.0**contact.exponent", "1000.0"),
    ("friction's velocity in mm/s", "solve/si_record.py",
     'to_si(friction.friction_velocity_mm_per_s, "mm/s")', "friction.friction_velocity_mm_per_s"),
    ("the piston's diameter for its radius", "solve/si_record.py",
     "math.pi * to_si(gas.piston_radius_mm", "math.pi / 4 * to_si(gas.piston_radius_mm"),
    # march, control, onset, tally, observe, integrate
    ("no restart at a corner", "physics/march.py",
     "if fresh or at_edge else", "if fresh else"),
    ("steps a hundred times too long accepted", "physics/march.py",
     "if not error <= 1.0", "if not error <= 100.0"),
    ("the control's order as its power", "physics/step_control.py",
     "1e-10)) / order)", "1e-10)) * order)"),
    ("a pulse between two looks stepped over", "physics/onset.py",
     "before + rise + fall > 0.0", "before > 0.0"),
    ("contact always counts as touching", "physics/tally.py",
     "tally.flown[joint] = touching, flown", "tally.flown[joint] = 1, flown"),
    ("the small end's friction loss left out", "physics/observe.py",
     "- small.friction * small.slip", ""),
    ("the rod's inertia missing in an ideal joint's force", "physics/motion.py",
     "-p.rod_inertia * spin_up", "0.0"),
    ("the march's atol is 1e-6", "solve/run.py",
     "request.rtol * size, size", "0.0 * size + 1e-6, size"),
    ("SciPy's atol is 1e-6", "solve/si_record.py",
     "return rtol * np.concatenate((natural_sizes", "return 1e-6 * np.concatenate((natural_sizes"),
    ("SciPy's phase is not changed at a corner", "solve/scipy_driver.py",
     "run.phase = int(phases[i])", "run.phase = 0"),
]  # fmt: skip


def bugs():
    """The thirty as mutants; raises LookupError where a text is no longer there."""
    return [planted(*bug) for bug in BUGS]
