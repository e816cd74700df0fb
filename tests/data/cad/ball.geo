// A ball, for the oracles of tests/nightly.sh.
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 10};
