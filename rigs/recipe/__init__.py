"""The recipe of the default rig: offline steps from the CC0 MakeHuman data to one GLB. Never imported by the runtime."""
