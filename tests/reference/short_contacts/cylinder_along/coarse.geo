// cylinder_along, element sizes × 1; written by apps/lab/reference, lengths in mm
SetFactory("OpenCASCADE");
General.NumThreads = 1; Mesh.RandomSeed = 1;  // the same mesh every time
Mesh.ElementOrder = 2; Mesh.HighOrderOptimize = 1; Mesh.Optimize = 1;
Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0;
Mesh.CharacteristicLengthFromCurvature = 0;
Box(1) = {0, 0, -48, 48, 48, 96};
Sphere(2) = {0, 0, 0, 1};
Dilate {{0, 0, 0}, {24, 18, 21}} { Volume{2}; }
Translate {0, 0, 0} { Volume{2}; }
Cylinder(3) = {0, 0, -3, 0, 0, 3, 2};
Rotate {{0, 1, 0}, {0, 0, 0}, 0} { Volume{3}; }
Translate {0, 0, -12} { Volume{3}; }
tissue() = BooleanDifference{ Volume{1}; Delete; }{ Volume{3}; Delete; };
gland() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{tissue()}; };
all() = BooleanFragments{ Volume{tissue()}; Delete; }{ Volume{gland()}; Delete; };
Field[1] = MathEval;
Field[1].F = "3.2+4.5*(abs(sqrt(((x-(0))/24)^2+((y-(0))/18)^2+((z-(0))/21)^2)-1)+sqrt(((x-(0))/24)^2+((y-(0))/18)^2+((z-(0))/21)^2)-1)/2";
Field[2] = MathEval;
Field[2].F = "0.4+0.25*abs((sqrt(abs((x-(0))^2+(y-(0))^2+(z-(-13.5))^2-((0)*(x-(0))+(0)*(y-(0))+(1)*(z-(-13.5)))^2)+((abs(abs((0)*(x-(0))+(0)*(y-(0))+(1)*(z-(-13.5)))-0)+abs((0)*(x-(0))+(0)*(y-(0))+(1)*(z-(-13.5)))-0)/2)^2)-2))";
Field[3] = Min; Field[3].FieldsList = {1, 2}; Background Field = 3;
