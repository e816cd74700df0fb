// A plate of 12 x 8 x 4 mm with a bore of 4 mm, for gmsh_plate.msh: `gmsh gmsh_plate.geo -3 -o gmsh_plate.msh`.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 12, 8, 4};
Cylinder(2) = {4.5, 4, 0, 0, 0, 4, 2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Mesh.MeshSizeFactor = 2.2;
