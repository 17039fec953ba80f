# Where each method fails, over Fresnel number and radius or frequency:
# gnuplot -e "data = 'FOLDER'; charts = 'FOLDER'" psf_maps.gp
load 'tests/bench/psf_style.gp'
set terminal svg size 960,940 font "Helvetica,11" background "#ffffff" enhanced
set output charts.'/psf_maps.svg'
set multiplot

# Classes of the error over the profile's own peak.
class(error) = error <= 1e-9 ? 0 : error <= 1e-6 ? 1 : error <= 1e-3 ? 2 : error <= 1 ? 3 : 4
array colours[5] = ["#eef4fa", "#b7d3ea", "#6ba3d0", "#f4a259", "#a61c00"]
array meanings[5] = ["up to 10^{-9}", "up to 10^{-6}", "up to 10^{-3}", "fails: up to 1", "fails: above 1"]
set palette defined (0 colours[1], 1 colours[2], 2 colours[3], 3 colours[4], 4 colours[5]) maxcolors 5
set cbrange [-0.5 : 4.5]
unset colorbox
unset key
unset grid
set samples 2
set xrange [-2.05 : 2.05]
set xtics ("" -2, "0.1" -1, "1" 0, "10" 1, "" 2) scale 0.5 offset 0, 0.4
set xlabel "N_F" offset 0, 1.2
set tics front
set lmargin 0
set rmargin 0
set tmargin 0
set bmargin 0

# The panels span Fresnel numbers 0.01 to 100, in rows of five from the top; `first` is the lower
# edge of the first row.
kColumns = 5
set size 0.165, 0.115
left_of(k) = 0.07 + 0.186 * (k % kColumns)
lower_edge(k, first) = first - 0.19 * (k / kColumns)

# Point spread: v on a logarithmic axis; the line is the geometric rim v = |U|.
set yrange [-1.05 : 3.35]
do for [k = 0:12] {
  if (k % kColumns == 0) {
    set ylabel "v" offset 1.5, 0
    set ytics ("0.1" -1, "1" 0, "10" 1, "100" 2, "1000" 3) scale 0.5 offset 0.5, 0
  } else {
    unset ylabel
    set ytics ("" -1, "" 0, "" 1, "" 2, "" 3) scale 0.5
  }
  set origin left_of(k), lower_edge(k, 0.84)
  set title "|G|^2: ".word(psf_methods, k + 1) offset 0, -0.7
  plot data.'/psf_map.csv' skip 1 using (log10($1)):(log10($2)):(class(column(k + 3))) with image notitle, \
       log10(2 * pi) + x with lines lc rgb "#000000" dt 2 lw 0.8 notitle
}

# OTF: s from 0 to the cut-off.
set yrange [0 : 2]
do for [k = 0:9] {
  if (k % kColumns == 0) {
    set ylabel "s" offset 1.5, 0
    set ytics ("0" 0, "0.5" 0.5, "1" 1, "1.5" 1.5, "2" 2) scale 0.5 offset 0.5, 0
  } else {
    unset ylabel
    set ytics ("" 0, "" 0.5, "" 1, "" 1.5, "" 2) scale 0.5
  }
  set origin left_of(k), lower_edge(k, 0.25)
  set title "OTF: ".word(otf_methods, k + 1) offset 0, -0.7
  plot data.'/otf_map.csv' skip 1 using (log10($1)):2:(class(column(k + 3))) with image notitle
}

# The key, in the place of the point spreads' last two panels.
set origin left_of(13), lower_edge(13, 0.84)
unset xlabel
unset ylabel
unset tics
unset border
set title "error over the profile's own peak" offset 2, -0.7
set key inside left top Left reverse samplen 2 spacing 1.3
plot for [i = 1:5] NaN with points pt 5 ps 1.6 lc rgb colours[i] title meanings[i]
unset multiplot
