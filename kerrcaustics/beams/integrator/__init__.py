"""The integrator: rays and beams in Mino time by steps of a Runge-Kutta-Nystroem pair."""
