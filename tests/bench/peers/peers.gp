# CPU seconds against error for every scene and program:
#   gnuplot -e "folder = 'FOLDER'" tests/bench/peers/peers.gp
# reads peers.csv of compare.py, writes peers.svg beside it.
set datafile separator ";"
set encoding utf8

scenes = system("tail -n +2 '".folder."/peers.csv' | cut -d';' -f1 | awk '!seen[$0]++'")
count = words(scenes)
columns = count > 1 ? 2 : 1
lines = (count + columns - 1) / columns

set terminal svg size 480 * columns, 40 + 340 * lines font "Helvetica,12" background "#ffffff" enhanced
set output folder.'/peers.svg'
set border lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5 dt 1
set logscale xy
set format x "%g"
set format y "10^{%T}"
set xrange [0.3 : 300]
set yrange [2e-5 : 1e4]
set xlabel "processor time, whole process (s)"
set ylabel "relMSE"
set key top right Left reverse samplen 2 spacing 1.05 font ",11"

in_row(scene, program, adaptive) = \
  strcol(1) eq scene && strcol(2) eq program && int(column(3)) == adaptive

set multiplot layout lines, columns
do for [scene in scenes] {
  set title scene noenhanced
  plot folder.'/peers.csv' skip 1 using (in_row(scene, "fstop", 0) ? $4 : NaN):6 \
         with linespoints lw 2 pt 7 ps 0.6 lc rgb "#000000" title "fstop, by max\\_error", \
       '' skip 1 using (in_row(scene, "Cycles", 0) ? $4 : NaN):6 \
         with linespoints lw 1.4 pt 5 ps 0.6 lc rgb "#0072b2" title "Blender Cycles, by samples", \
       '' skip 1 using (in_row(scene, "Cycles", 1) ? $4 : NaN):6 \
         with points lw 1.6 pt 4 ps 1.0 lc rgb "#0072b2" title "Cycles, adaptive", \
       '' skip 1 using (in_row(scene, "POV-Ray", 0) ? $4 : NaN):6 \
         with linespoints lw 1.4 pt 9 ps 0.7 lc rgb "#d55e00" title "POV-Ray, by samples"
}
unset multiplot
