// push_homogeneous, element sizes × 1; written by apps/lab/reference, lengths in mm
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
Sphere(3) = {0, 0, -21, 2};
tissue() = {1};
gland() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{1}; };
rim() = BooleanIntersection{ Volume{3}; Delete; }{ Volume{1}; };
all() = BooleanFragments{ Volume{1}; Delete; }{ Volume{gland(), rim()}; Delete; };
Field[1] = MathEval;
Field[1].F = "3.2+4.5*(abs(sqrt(((x-(0))/24)^2+((y-(0))/18)^2+((z-(0))/21)^2)-1)+sqrt(((x-(0))/24)^2+((y-(0))/18)^2+((z-(0))/21)^2)-1)/2";
Field[2] = MathEval;
Field[2].F = "0.05+0.4*abs(sqrt((sqrt((x-(0))^2+(y-(0))^2+(z-(-21))^2)-2)^2+((sqrt(((x-(0))/24)^2+((y-(0))/18)^2+((z-(0))/21)^2)-1)/0.047619047619)^2))";
Field[3] = Min; Field[3].FieldsList = {1, 2}; Background Field = 3;
