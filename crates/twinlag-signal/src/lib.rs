//! Two-sensor records from a described rig, integrated in continuous time.
