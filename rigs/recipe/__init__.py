"""How the default rig is made: offline steps from the CC0 MakeHuman data to one GLB. The runtime never imports this."""
