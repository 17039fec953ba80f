# Error against Fresnel number (left) and defocus in waves (right):
# gnuplot -e "data = 'FOLDER'; charts = 'FOLDER'" psf_errors.gp
load 'tests/bench/psf_style.gp'
set terminal svg size 960,1080 font "Helvetica,12" background "#ffffff" enhanced
set output charts.'/psf_errors.svg'
set multiplot
set logscale y
set yrange [kLeast : kMost]
set ytics 1e-16, 1e3, 1e2
set mytics 1

set tmargin 2.2
set bmargin 3.2

row_is(sweep, quantity, method) = \
  strcol(1) eq sweep && strcol(2) eq quantity && strcol(3) eq method

# Three rows of two panels; the right one has the key.
do for [row = 1:3] {
  quantity = row == 3 ? "otf" : "psf"
  methods = row == 3 ? otf_methods : psf_methods
  column_of_error = row == 2 ? 7 : 6
  set ylabel (row == 1 ? "error over the peak in focus" : \
              row == 2 ? "error over the profile's own peak" : "error of the OTF")
  name = row == 3 ? "OTF" : "Point spread"
  do for [sweep in "pinhole lens"] {
    left = sweep eq "pinhole"
    set origin (left ? 0 : 0.4), (3 - row) / 3.0
    set size (left ? 0.4 : 0.6), 1 / 3.0
    if (left) {
      unset key
      set logscale x
      set xrange [0.01 : 100]
      set format x "%g"
      set xtics auto
      set xlabel "Fresnel number N_F"
    } else {
      set key outside right center vertical samplen 1.2 spacing 1.1 font ",11"
      unset logscale x
      set xrange [0 : 20]
      set xtics 5
      set xlabel "defocus W_{20} (waves)"
      unset ylabel
    }
    set title name.(left ? ", pinhole" : ", lens")
    plot for [i = 1:words(methods)] data.'/psf_errors.csv' skip 1 \
      using (row_is(sweep, quantity, word(methods, i)) ? column(left ? 4 : 5) : NaN):\
      (within(column(column_of_error))) \
      with lines lt (row == 3 ? otf_types[i] : i) title word(methods, i)
  }
}
unset multiplot
