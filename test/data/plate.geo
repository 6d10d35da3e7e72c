SetFactory("Built-in");
Point(1) = {0,0,0,0.7}; Point(2) = {2,0,0,0.7}; Point(3) = {2,1,0,0.7}; Point(4) = {0,1,0,0.7}; Point(5) = {1,0,0,0.7}; Point(6) = {1,1,0,0.7};
Line(1) = {1,5}; Line(2) = {5,2}; Line(3) = {2,3}; Line(4) = {3,6}; Line(5) = {6,4}; Line(6) = {4,1}; Line(7) = {5,6};
Line Loop(1) = {1,7,5,6}; Plane Surface(1) = {1};
Line Loop(2) = {2,3,4,-7}; Plane Surface(2) = {2};
Physical Surface("left part") = {1}; Physical Surface("right part") = {2}; Physical Surface("whole") = {1,2};
Physical Curve("clamp") = {6}; Physical Curve("tip") = {3}; Physical Point("A") = {3};
