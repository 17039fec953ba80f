# Spectra and convergence of sampling patterns. Expects `data` (the folder of spectra.csv and
# convergence.csv) and `charts` (the folder for the picture).

set datafile separator ";"
set encoding utf8
set terminal svg size 1080,420 font "sans-serif,12" background "#ffffff"
set output charts."/patterns.svg"
set multiplot layout 1,2
set border 3 lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5
array colors[5] = ["#999999", "#56b4e9", "#d55e00", "#009e73", "#0072b2"]
array styles[5] = [6, 8, 4, 10, 7]

set title "Mean power of 256 points (independent points: 1)"
set xlabel "waves across the pixel"
set ylabel "power"
set xrange [0:48]
set yrange [0:3]
set key top right reverse Left samplen 2
plot for [i=1:5] data."/spectra.csv" using 1:i+1 with lines lw 2 lc rgb colors[i] title columnhead(i+1)

set title "Error of one picture (slats, f/1.4), pattern in pixel and lens"
set xlabel "samples a pixel"
set ylabel "RMSE"
set logscale xy
set xrange [1.6:640]
set yrange [*:*]
set key bottom left
plot for [i=1:5] data."/convergence.csv" using 1:i+1 with linespoints lw 2 pt styles[i] lc rgb colors[i] title columnhead(i+1)
unset multiplot
