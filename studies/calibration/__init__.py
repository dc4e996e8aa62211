"""Infer parameters of scenes from measured data: designed runs, emulators, narrowing waves, posterior."""
