hal panel panel-line.panel
