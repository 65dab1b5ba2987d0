hal panel panel-element.xml
