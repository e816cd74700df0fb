// The solid inside a closed triangulation, for docs/from-cad.md.
Merge "plate.stl";
Surface Loop(1) = {1};
Volume(1) = {1};
