# Sharpness over diameter, measured and in theory:
#   gnuplot -e "folder = 'FOLDER'" tests/bench/pinhole_series.gp
# reads series.csv and theory.csv of pinhole_series_chart, writes series.svg beside them.
set datafile separator ";"
set encoding utf8
set terminal svg size 860,500 font "Helvetica,13" background "#ffffff" enhanced
set output folder.'/series.svg'
set border lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5 dt 1
set logscale xy
set xrange [0.045 : 2.2]
set yrange [0.2 : 12]
set xtics (0.05, 0.07, 0.1, 0.15, 0.25, 0.35, 0.6, 1, 2)
set ytics (0.2, 0.5, 1, 2, 5, 10)
set xlabel "diameter of the hole (mm); screen 50 mm behind it, target 2 m before it"
set ylabel "resolution on the screen (cycles/mm)"
set key left top Left reverse samplen 2

# Optima of the classical criterion, c = 2, and of the two curves for one wavelength of the green
# band's middle, 540 nm: c sqrt(lambda / (1/f' + 1/u)).
unit = sqrt(540e-6 / (1/50. + 1/2000.))
set for [c in "1.377 1.778 2.000"] arrow from c * unit, 0.2 to c * unit, 12 nohead lc rgb "#999999" dt 2 lw 0.8
set label 1 "c = 1.38" at 1.377 * unit, 0.28 rotate by 90 offset -0.7, 0 font ",11" tc rgb "#555555"
set label 2 "c = 1.78" at 1.778 * unit, 0.28 rotate by 90 offset -0.7, 0 font ",11" tc rgb "#555555"
set label 3 "c = 2, brightest" at 2.0 * unit, 0.28 rotate by 90 offset 1.0, 0 font ",11" tc rgb "#555555"

plot folder.'/theory.csv' skip 1 using 1:3 with lines lw 1.6 lc rgb "#0072b2" title "theory, contrast 10 %", \
     folder.'/series.csv' skip 1 using 1:($11 > 0 ? $11 : NaN) with points pt 6 ps 0.7 lw 1.6 lc rgb "#0072b2" title "measured, sinusoidal star", \
     folder.'/theory.csv' skip 1 using 1:2 with lines lw 1.6 lc rgb "#d55e00" title "theory, contrast 50 %", \
     folder.'/series.csv' skip 1 using 1:($9 > 0 ? $9 : NaN) with points pt 7 ps 0.6 lc rgb "#d55e00" title "measured, slanted edge"
