"""A performer whose truth is known: a face unlike the rig's, moved by known motion, seen by imperfect cameras."""
