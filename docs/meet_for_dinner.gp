# Draws docs/meet_for_dinner.svg from the exported estimates of a run (gnuplot 5.4, package gnuplot-nox):
#   consort run experiments/meet_for_dinner.yaml --output results/figure && consort export results/figure --csv
#   gnuplot -e "data='results/figure/csv/estimates.csv'" docs/meet_for_dinner.gp
set terminal svg size 880,360 font "DejaVu Sans,12" background "#ffffff"
set output "docs/meet_for_dinner.svg"
set datafile separator ","
set key off
set border 3 lc rgb "#5a6a78"
set tics nomirror out textcolor rgb "#3b4a5a"
set xlabel "round" textcolor rgb "#3b4a5a"
set ylabel "estimate of the time for dinner, h" textcolor rgb "#3b4a5a"
set grid ytics lc rgb "#e4e8ec" lw 1
set xrange [0:120]
set cbrange [1:10]
set palette defined (1 "#2c5f8a", 5 "#7fa7c6", 6 "#e0a37e", 10 "#b3541e")
unset colorbox
# rows are ordered by round, then agent
plot for [agent=1:10] data skip 1 every 10::(agent-1)::1209 using 2:5 with steps lw 1.2 lc palette cb agent
