// A plate of 40 x 20 x 10 mm with two bores of 8 and 12 mm, for docs/from-cad.md. Volume: 8000 - 520 pi = 6366.4 mm^3.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 40, 20, 10};
Cylinder(2) = {10, 10, 0, 0, 0, 10, 4};
Cylinder(3) = {28, 10, 0, 0, 0, 10, 6};
BooleanDifference(4) = { Volume{1}; Delete; }{ Volume{2, 3}; Delete; };
