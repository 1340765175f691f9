"""Sweeps over sensors, exposures, temperatures, skies and demosaicking methods, from one YAML to one table.

    mistakes     what is wrong with a sweep, in plain words
    lines        YAML with the line of each value
    programs     what the installed programs are and know
    request      a sweep as it was asked for
    values       values of a YAML file, read one by one
    axes         what is swept, and which frames stay
    reading      the YAML of a sweep, checked before anything runs
    conditions   what is simulated, each with its seed and the options of the programs
    plan         which files are made, and by which ranges of frames
    pipeline     the shell pipelines of the jobs
    files        complete files or none; BLAKE3
    reports      what `measure` says, as a row for each frame
    table        the ranges of all conditions as one table
    summary      a row for each condition, stage and channel, with tests
    plots        figures of the summary

A module uses those above it alone.
"""
