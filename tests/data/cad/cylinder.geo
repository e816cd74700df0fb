// A cylinder, for the oracles of tests/nightly.sh.
SetFactory("OpenCASCADE");
Cylinder(1) = {0, 0, 0, 0, 0, 20, 6};
