# Texture filters on a receding checkerboard. Expects `data` (the folder of textures.csv) and
# `charts` (the folder for the picture).

set datafile separator ";"
set encoding utf8
set terminal svg size 1080,420 font "sans-serif,12" background "#ffffff"
set output charts."/textures.svg"
set multiplot layout 1,2
set border 3 lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5
names = "nearest brute-force mipmap anisotropic summed-area stochastic"
array colors[6] = ["#999999", "#0072b2", "#009e73", "#e69f00", "#d55e00", "#cc79a7"]
set logscale xy
set xlabel "milliseconds, one thread"
set ylabel "RMSE against 4,096 lookups a pixel"
set key bottom left samplen 2
rows(camera, i) = "< grep '^".camera.";".word(names, i).";' ".data."/textures.csv"
set title "Pinhole: all in focus"
plot for [i=1:6] rows("pinhole", i) using 5:4 with linespoints lw 2 pt 7 ps 0.6 lc rgb colors[i] title word(names, i)
set title "Lens, f/1.4 focused at 3 m: the blur does the filtering"
plot for [i=1:6] rows("lens", i) using 5:4 with linespoints lw 2 pt 7 ps 0.6 lc rgb colors[i] title word(names, i)
unset multiplot
