# How cost grows with threads, pixels and triangles. Expects `data` (the folder of scaling.csv) and
# `charts` (the folder for the picture).

set datafile separator ";"
set encoding utf8
set terminal svg size 1080,360 font "sans-serif,12" background "#ffffff"
set output charts."/scaling.svg"
csv = data."/scaling.csv"

set multiplot layout 1,3
set border 3 lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5
set key top left Left reverse samplen 2
set style data linespoints

set title "Threads (1 megapixel, 100,000 triangles)"
set xlabel "threads"
set ylabel "seconds"
set xrange [0.5:4.5]
set yrange [0:*]
set xtics (1, 2, 4)
plot csv index 0 using 1:2 skip 1 lc rgb "#0072b2" pt 7 title "wall", \
     csv index 0 using 1:3 skip 1 lc rgb "#e69f00" pt 5 title "processor"

set title "Pixels (one thread)"
set xlabel "megapixels"
set ylabel "seconds of processor"
set y2label "bytes a pixel"
set logscale xy
set xrange [0.2:20]
set yrange [*:*]
set y2range [0:*]
set xtics (0.25, 1, 4, 16)
set y2tics
first(i) = system("sed -n '/^megapixels/{n;p}' ".csv." | cut -d';' -f".i) + 0.0
plot csv index 1 using 1:2 skip 1 lc rgb "#0072b2" pt 7 title "time", \
     first(2)*x/first(1) lc rgb "#888888" dt 2 title "in proportion", \
     csv index 1 using 1:4 skip 1 axes x1y2 lc rgb "#e69f00" pt 5 title "memory"

set title "Triangles (960 x 640 pixels, one thread)"
set xlabel "triangles"
set ylabel "ns a sample, one shadow ray"
set y2label "bytes a triangle"
unset logscale y
set xrange [500:2e7]
set yrange [0:*]
set xtics ("10^3" 1e3, "10^4" 1e4, "10^5" 1e5, "10^6" 1e6, "10^7" 1e7)
plot csv index 2 using 1:3 skip 1 lc rgb "#0072b2" pt 7 title "time", \
     csv index 2 using 1:5 skip 1 axes x1y2 lc rgb "#e69f00" pt 5 title "memory"
unset multiplot
