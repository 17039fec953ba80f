# Time against error: gnuplot -e "data = 'FOLDER'; charts = 'FOLDER'" psf_times.gp
load 'tests/bench/psf_style.gp'
set terminal svg size 960,560 font "Helvetica,12" background "#ffffff" enhanced
set output charts.'/psf_times.svg'
set multiplot
set logscale xy
set format x "10^{%T}"
set xlabel "processor time for 512 points (ms)"
set yrange [kLeast : kMost]
set ytics 1e-16, 1e3, 1e2
set mytics 1
set key at graph 0.02, 0.57 left top Left reverse samplen 1.5 spacing 0.95 font ",10"

row_is(quantity, method) = strcol(1) eq quantity && strcol(2) eq method

set origin 0, 0
set size 0.5, 1
set xrange [1e-4 : 1e3]
set title "Point spread: |G|^2"
set ylabel "largest error over the peak in focus"
plot for [i = 1:13] data.'/psf_times.csv' skip 1 \
  using (row_is("psf", word(psf_methods, i)) ? $5 : NaN):(within($6)) \
  with linespoints lt i title word(psf_methods, i)

set origin 0.5, 0
set size 0.5, 1
set title "OTF"
set ylabel "largest error"
plot for [i = 1:10] data.'/psf_times.csv' skip 1 \
  using (row_is("otf", word(otf_methods, i)) ? $5 : NaN):(within($6)) \
  with linespoints lt otf_types[i] title word(otf_methods, i)
unset multiplot
