# What the charts of the point-spread methods share. Expects `data` (the folder of CSV files) and
# `charts` (the folder for the pictures).

set datafile separator ";"
set datafile missing NaN
set encoding utf8

# One colour a family, one mark a member. Black dots: what the images are made with.
set linetype  1 lc rgb "#000000" lw 1.6 pt 7  ps 0.55
set linetype  2 lc rgb "#0072b2" lw 1.2 pt 5  ps 0.5
set linetype  3 lc rgb "#56b4e9" lw 1.2 pt 4  ps 0.5
set linetype  4 lc rgb "#e69f00" lw 1.2 pt 9  ps 0.6
set linetype  5 lc rgb "#e69f00" lw 1.2 pt 8  ps 0.6 dt 2
set linetype  6 lc rgb "#e69f00" lw 1.2 pt 10 ps 0.6 dt 3
set linetype  7 lc rgb "#009e73" lw 1.2 pt 12 ps 0.6 dt 3
set linetype  8 lc rgb "#009e73" lw 1.2 pt 12 ps 0.7 dt 2
set linetype  9 lc rgb "#009e73" lw 1.2 pt 13 ps 0.7
set linetype 10 lc rgb "#d55e00" lw 1.2 pt 6  ps 0.5
set linetype 11 lc rgb "#cc79a7" lw 1.2 pt 1  ps 0.6
set linetype 12 lc rgb "#7f3c8d" lw 1.2 pt 2  ps 0.6
set linetype 13 lc rgb "#888888" lw 1.2 pt 3  ps 0.6

psf_methods = '"series" "Lommel" "Lommel, wrong side" "quadrature, growing" "quadrature, 24" "quadrature, 96" "FFT 128" "FFT 256" "FFT 512" "disc" "disc x Airy" "stretched disc" "Airy"'
otf_methods = '"Hopkins, growing" "Hopkins, 24" "Hopkins, 96" "FFT 128" "FFT 256" "FFT 512" "disc" "disc x Airy" "stretched disc" "Airy"'
# Line types of the OTF's methods: Hopkins's integral as the quadratures, with the shipped one black.
array otf_types[10] = [1, 5, 6, 7, 8, 9, 10, 11, 12, 13]

# The value where the row belongs to the method, else a gap; errors beyond the axis at its end.
kLeast = 1e-17
kMost = 1e2
within(error) = error > kMost ? kMost : (error < kLeast ? kLeast : error)
set format y "10^{%T}"
set border lw 0.8
set tics nomirror
set grid lc rgb "#dddddd" lt 1 lw 0.5 dt 1
