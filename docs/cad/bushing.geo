// The plate of plate.geo with a bushing of 2 mm in the larger bore, for docs/from-cad.md.
SetFactory("OpenCASCADE");
Merge "plate.step";
Cylinder(2) = {28, 10, 0, 0, 0, 10, 6};
Cylinder(3) = {28, 10, 0, 0, 0, 10, 4};
BooleanDifference(4) = { Volume{2}; Delete; }{ Volume{3}; Delete; };
BooleanFragments{ Volume{1}; Delete; }{ Volume{4}; Delete; }
Physical Volume("plate") = {1};
Physical Volume("bushing") = {4};
