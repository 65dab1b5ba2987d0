# packages: tdma canopen
hal node io --id 5 --link cane:eth:lo --tdma tdma-line.tdma
